"""The judge of collisions judged: which played collision answers which true one, and who is not
blamed; missing no collision is no merit where none is judged."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.commands.run import medians
from crosscheck2d.reports.compare.collisions import closest_in_order, match
from crosscheck2d.reports.compare.comparison import Comparison, compare
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.view import LEAST_SHARE, NOT_JUDGED, Value
from crosscheck2d.reports.page.scenes import scenes_of
from crosscheck2d.scenarios.catalogue import SCENARIOS, scenario
from crosscheck2d.scenarios.model import Collisions, Scenario, Trajectory
from tests.reports.compare.answers import beside_truth, truth_of


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


# How many are judged.

NAMES = ("collisions_missed", "collisions_spurious", "first_wrong_collision_s")
NOTHING = Collisions.of([])
WITH_TRUTH = [name for name in SCENARIOS if scenario(name).truth]


def read(one: Scenario, dt: float, played: Trajectory, truth: Trajectory) -> dict[str, Value]:
    """The three metrics of a trajectory beside the truth."""
    view = beside_truth(one, dt, played, truth)
    found = {name: METRICS[name].of(view) for name in NAMES}
    return {name: value for name, value in found.items() if value is not None}


def counts(note: str) -> tuple[int, int]:
    """k and n of "k of n collisions judged", wherever in the note."""
    words = note.removesuffix(" collisions judged").split()
    return int(words[-3]), int(words[-1])


@pytest.mark.parametrize("name", WITH_TRUTH)
def test_an_engine_that_reports_no_collision_is_caught_wherever_one_is_judged(name: str):
    one, truth = truth_of(name)
    for dt in map(one.dt, one.substeps):
        silent, right = (
            read(one, dt, each, truth) for each in (replace(truth, collisions=NOTHING), truth)
        )
        if not len(truth.collisions):
            assert silent["collisions_missed"].note.startswith(NOT_JUDGED)
            assert silent["collisions_spurious"].value == 0
            assert silent["first_wrong_collision_s"].value == np.inf
            continue
        judged, total = counts(right["collisions_missed"].note)

        assert total == len(truth.collisions)
        assert counts(silent["collisions_missed"].note) == (judged, total)
        if judged < LEAST_SHARE * total:
            for value in (*silent.values(), *right.values()):
                assert np.isnan(value.value)
                assert value.note.startswith(f"{NOT_JUDGED}: only ")
        else:
            assert silent["collisions_missed"].value == judged > 0
            assert right["collisions_missed"].value == 0
            assert np.isfinite(silent["first_wrong_collision_s"].value)
            assert right["first_wrong_collision_s"].value == np.inf


@pytest.mark.parametrize(
    ("name", "judged", "total"),
    [
        ("column_of_ten", 0, 10),
        ("rest_on_floor", 0, 1),
        ("slide_on_incline", 0, 1),
        ("galperin_314", 27, 314),
        ("bouncing_ball_e09", 30, 86),
        ("cradle_touching", 2, 6),
        ("gas_of_100", 303, 362),
    ],
)
def test_contacts_at_rest_and_collisions_too_close_for_a_step_are_not_counted_as_judged(
    name: str, judged: int, total: int
):
    # At the coarsest step; as they were counted by hand.
    one, truth = truth_of(name)
    found = read(one, one.dt(one.substeps[0]), truth, truth)["collisions_missed"]

    assert counts(found.note) == (judged, total)
    assert np.isnan(found.value) == (judged < LEAST_SHARE * total)


def test_a_finer_step_judges_more_collisions():
    one, truth = truth_of("galperin_314")
    notes = [read(one, one.dt(k), truth, truth)["collisions_missed"].note for k in one.substeps]
    judged = [counts(note)[0] for note in notes]

    assert judged == sorted(judged)
    assert judged[0] < judged[-1]


def wrong_collisions(comparison: Comparison) -> str | None:
    headings, [row], _ = medians(scenes_of([comparison]), ["pymunk:matched"], set())
    return dict(zip(headings, row)).get("Wrong\ncolli-\nsions\nnumber")


def test_where_there_is_no_collision_none_is_missed_but_one_may_be_spurious():
    one, truth = truth_of("near_miss")
    invents = replace(truth, collisions=Collisions.of([(one.duration / 2, 0, 1, 1.0)]))
    found = read(one, one.dt(1), invents, truth)
    runs = [Run("pymunk", "matched", one.name, one.dt(k), trajectory=invents) for k in one.substeps]

    assert found["collisions_missed"].note == f"{NOT_JUDGED}: no collision to miss"
    assert found["collisions_spurious"].value == 1
    assert found["first_wrong_collision_s"].value == one.duration / 2
    for played, total in ((invents, "1"), (truth, "0")):
        each = compare(one, [replace(run, trajectory=played) for run in runs])
        assert wrong_collisions(each) == total


def test_a_scene_in_which_too_few_collisions_are_judged_is_left_out_of_the_sum():
    one, truth = truth_of("column_of_ten")
    runs = [Run("pymunk", "matched", one.name, one.dt(k), trajectory=truth) for k in one.substeps]

    assert wrong_collisions(compare(one, runs)) is None
