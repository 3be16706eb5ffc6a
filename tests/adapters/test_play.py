"""Where a collision begins in the impulses that an engine reports, step by step."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from adapters.engine import ContactImpulse
from adapters.play import first_collisions


def test_weight_in_consecutive_steps_is_one_collision_and_collisions_are_each_their_own():
    """Impulses no larger than weight continue the one before; a larger one is a collision again, a step later or
    not."""
    collisions = [
        ContactImpulse(3, 1, 0, 2.0),
        ContactImpulse(4, 0, 1, 1.0),
        ContactImpulse(5, 1, 0, 1.0),
        ContactImpulse(7, 0, 1, 4.0),
        ContactImpulse(4, -1, 0, 8.0),
    ]
    found = first_collisions(collisions, 0.5, weight=1.0)
    assert len(first_collisions(collisions, 0.5)) == 5
    assert (
        len(first_collisions([*collisions, ContactImpulse(9, 0, 1, 1e-9)], 0.5)) == 5
    )  # a rounding of the impulses above
    assert found.t.tolist() == [2.0, 2.5, 4.0]
    assert list(zip(found.i.tolist(), found.j.tolist())) == [(0, 1), (0, -1), (0, 1)]
    assert found.impulse.tolist() == [2.0, 8.0, 4.0]
    assert len(first_collisions([], 0.5)) == 0


@settings(derandomize=True)
@given(st.sets(st.tuples(st.integers(0, 12), st.sampled_from([(0, 1), (0, 2), (1, 2), (1, -1), (1, -2)]))))
def test_collisions_are_the_beginnings_of_runs_of_impulses(impulses):
    """Counted the slow way: an impulse whose pair had none in the step before."""
    rows = sorted((step, pair) for step, pair in impulses)
    found = first_collisions([ContactImpulse(step, *pair, 1.0) for step, pair in rows], 1.0, weight=1.0)
    begins = {(step + 1.0, *pair) for step, pair in impulses if (step - 1, pair) not in impulses}
    assert set(zip(found.t.tolist(), found.i.tolist(), found.j.tolist())) == begins
    assert (np.diff(found.t) >= 0).all()
