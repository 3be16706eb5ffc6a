"""Coulomb's friction in many digits: in a collision, and on the wall on which a disk rests.

One coefficient mu, and no rolling resistance. A collision changes the slip s of the contact points,
their relative speed along the tangent, by the impulse

    J_t = min(mu J_n, |s| / (1/m_a + 1/m_b + r_a^2/I_a + r_b^2/I_b)) against s,

where J_n = (1 + e) m_n v_n is that along the normal (Foerster, Louge, Chang & Allia, Phys. Fluids
6, 1108, 1994, with no tangential restitution). For disks that is what Coulomb's law at every
instant of a collision adds up to: the normal leads through the centre, so J_n gives no torque and
no slip, and J_t no speed along the normal. The slip falls in proportion to J_t whatever the course
of the normal force, and once it is 0 nothing drives it away from there (Stronge, Impact Mechanics,
2000, ch. 3 and 4).

On a wall the same law gives a force: mu N against the slip, or where there is none what keeps it 0,
if mu N is enough for that (any textbook of mechanics, under "rolling").
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from scenarios.truth.oracle.numbers import Number, Numbers


class Grip(NamedTuple):
    """What friction needs to know of the bodies: mu, and of each its radius m and 1 / inertia
    1/(kg m2)."""

    friction: Number
    radius: Sequence[Number]
    inverse_inertia: Sequence[Number]

    def softness(self, i: int) -> Number:
        """1/kg, by how much an impulse of 1 N s along its rim changes the speed of body i there by
        turning it."""
        return self.radius[i] * self.radius[i] * self.inverse_inertia[i]


def limited(k: Numbers, wanted: Number, most: Number) -> tuple[Number, bool]:
    """What keeps the slip 0, or as much of it as friction gives, `most` either way; and whether
    that is all."""
    if k.sign(most - wanted) < 0:
        return most, False
    if k.sign(most + wanted) < 0:
        return -most, False
    return wanted, True
