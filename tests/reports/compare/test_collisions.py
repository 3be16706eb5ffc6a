"""The judge of collisions judged: which played collision answers which true one, and who is not
blamed."""

from itertools import combinations

import numpy as np
import pytest

from crosscheck2d.reports.compare.collisions import closest_in_order, match
from crosscheck2d.scenarios.model import Collisions


def collisions(*times: float) -> Collisions:
    """Collisions of disks 0 and 1 at these times."""
    return Collisions.of([(t, 0, 1, 1.0) for t in times])


def test_a_missing_collision_is_missed_and_an_extra_collision_is_spurious():
    missed = match(collisions(1.01, 3.01), collisions(1, 2, 3), 10, 0.01)
    spurious = match(collisions(1.01, 2.5, 3.01), collisions(1, 3), 10, 0.01)

    assert missed.missed == [(2.0, 0, 1)]
    assert missed.spurious == []
    assert spurious.spurious == [(2.5, 0, 1)]
    assert spurious.missed == []
    np.testing.assert_allclose(spurious.delay, 0.01)


def test_an_engine_that_drifts_late_keeps_its_collisions_until_it_is_half_a_gap_late():
    true = np.arange(1.0, 9.0)
    late = match(collisions(*(true + 0.06 * true)), collisions(*true), 100, 0.01)
    too_late = match(collisions(9.0), collisions(1.0), 100, 0.01)

    assert late.first_wrong is None
    np.testing.assert_allclose(late.delay, 0.06 * true)
    assert (too_late.missed, too_late.spurious) == ([(1.0, 0, 1)], [(9.0, 0, 1)])


def test_a_collision_that_the_end_cuts_off_is_not_blamed():
    assert match(collisions(1.0), collisions(1.0, 9.98), 10.0, 0.01).missed == []
    assert match(collisions(1.0), collisions(1.0, 9.96), 10.0, 0.01).missed == [(9.96, 0, 1)]


def test_collisions_that_no_step_can_tell_apart_are_not_blamed():
    # Of ever faster bounces those closer together than 2 dt are left out, with what the engine
    # makes of them.
    true = 2.0 - 0.5 ** np.arange(12.0)
    played = [t for t in true if t < 1.97]
    found = match(collisions(*played, 1.99, 2.01), collisions(*true), 10.0, 0.01)

    assert found.first_wrong is None
    silent = match(collisions(), collisions(*true), 10.0, 0.01)
    assert found.judged == silent.judged == len(silent.missed)
    assert 0 < found.judged < len(true)


def test_weight_on_a_contact_at_rest_is_no_collision():
    resting = Collisions.of([(0.0, 0, -1, 0.0)])
    weight = Collisions.of([(0.1, 0, -1, 0.3), (0.5, 0, -1, 0.3)])

    assert match(weight, resting, 1.0, 0.01).first_wrong is None
    assert match(weight, resting, 1.0, 0.01).judged == 0


def test_matching_in_order_is_the_closest_there_is():
    rng = np.random.default_rng(1)
    for _ in range(100):
        many = np.sort(rng.uniform(size=rng.integers(0, 7)))
        few = np.sort(rng.uniform(size=rng.integers(0, len(many) + 1)))
        chosen = closest_in_order(few, many, 0.0)
        best = min(
            np.abs(few - many[list(some)]).sum()
            for some in combinations(range(len(many)), len(few))
        )

        assert (np.diff(chosen) > 0).all()
        # sums of six, in another order
        assert np.abs(few - many[chosen]).sum() == pytest.approx(best, rel=1e-12)
