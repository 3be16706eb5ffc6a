"""Coulomb friction in many digits: in a collision, and on the wall on which a disk rests.

There is one coefficient mu, and no rolling resistance. In a collision the impulse of friction
opposes the slip s, the relative speed of the contact points along the tangent:

    J_t = min(mu J_n, |s| / (1/m_a + 1/m_b + r_a^2/I_a + r_b^2/I_b)),

where J_n = (1 + e) m_n v_n is the impulse along the normal (Foerster, Louge, Chang & Allia, Phys.
Fluids 6, 1108, 1994, with no tangential restitution). For disks this is the integral of Coulomb's
law
over the collision: the normal passes through the centre, so J_n gives no torque and changes no
slip, and J_t changes no speed along the normal. The slip decreases in proportion to J_t, whatever
the course of the normal force, and once it is 0 it stays 0 (Stronge, Impact Mechanics,
2000, ch. 3 and 4).

On a wall the same law gives a force: mu N against the slip; without slip the force that keeps it 0,
if that is at most mu N (any textbook of mechanics, under "rolling").
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from crosscheck2d.scenarios.truth.oracle.numbers import Number, Numbers


class Friction(NamedTuple):
    """The data for friction: mu, and the radius, m, and 1 / inertia, 1/(kg m2), of each body."""

    coefficient: Number
    radius: Sequence[Number]
    inverse_inertia: Sequence[Number]

    def rim_inverse_mass(self, i: int) -> Number:
        """1/kg, the speed that an impulse of 1 N s along its rim gives the rim of body i by
        rotation."""
        return self.radius[i] * self.radius[i] * self.inverse_inertia[i]


def limited(k: Numbers, wanted: Number, most: Number) -> tuple[Number, bool]:
    """`wanted`, the friction that keeps the slip 0, limited to `most` either way; and whether it
    was within the limit."""
    if k.sign(most - wanted) < 0:
        return most, False
    if k.sign(most + wanted) < 0:
        return -most, False
    return wanted, True
