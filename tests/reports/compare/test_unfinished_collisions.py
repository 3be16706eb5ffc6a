"""The restitution of a collision that takes several steps is read when it is over, or not at
all."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from crosscheck2d.adapters.engine_row import FLOAT64
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.compare import restitution
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.restitution import Restitutions, effective_restitution
from crosscheck2d.reports.compare.view import View
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.model import Collisions, Scene, Trajectory
from tests.reports.compare.answers import beside_truth, truth_of

STEP = 0.05  # s
WALLS = [[[-9.0, 5.0], [9.0, 5.0]]]  # far away


def nothing_approaches(*given: Any) -> np.ndarray:
    """In place of `approach`: no pair is followed to a later sample."""
    return np.zeros(len(given[3]), bool)


def met(
    *after: float, e: float = 1.0, others: tuple[tuple[float, int, int], ...] = ()
) -> Restitutions:
    """Two equal disks that close at 2 m/s and touch at the third sample, where the collision is
    reported.

    `after`: m/s at which each flies away from the other in the samples from then on, negative as
    long as they approach. `others`: more collisions (s, i, j) that are reported.
    """
    speed = np.array([-1.0, -1.0, *after])
    t = STEP * np.arange(len(speed))
    way = np.cumsum(np.append(0.0, speed[1:])) * STEP
    way += 0.1 - way[2]
    still = np.zeros((len(t), 2))
    position = np.stack([np.stack([side * way, still[:, 0]], 1) for side in (1, -1)], 1)
    velocity = np.stack([np.stack([side * speed, still[:, 0]], 1) for side in (1, -1)], 1)
    scene = Scene(
        position=position[0],
        velocity=velocity[0],
        radius=[0.1] * 2,
        mass=[1] * 2,
        restitution=e,
        walls=WALLS,
    )
    collisions = Collisions.of([(2 * STEP, 0, 1, 1.0), *((*other, 1.0) for other in others)])
    return effective_restitution(
        Trajectory(t, position, velocity, still, still, collisions), scene, STEP, 0.0, FLOAT64
    )


def test_a_soft_contact_is_read_when_the_two_part(monkeypatch: pytest.MonkeyPatch):
    # Stopped and thrown back over three samples; without looking on, the control, e would be
    # negative.
    found = met(-0.6, -0.1, 0.5, 0.8, 0.8)
    # It is over as soon as they no longer approach: at 0.5, of which the third sample after the
    # contact reports.
    assert found.values == pytest.approx([0.5])
    assert (found.below, found.unfinished) == (0, 0)

    monkeypatch.setattr(restitution, "approach", nothing_approaches)
    assert met(-0.6, -0.1, 0.5, 0.8, 0.8).values == pytest.approx([-0.6])


def test_a_collision_that_is_over_at_once_is_read_as_before():
    for e in (0.0, 0.3, 1.0):
        assert met(e, e, e).values == pytest.approx([e])


def test_a_law_that_lets_two_pass_more_slowly_is_read_with_a_negative_e():
    found = met(*[-0.5] * 30)

    assert found.values == pytest.approx([-0.5])
    assert found.unfinished == 0


def test_a_collision_that_is_cut_off_is_counted_and_not_read():
    assert met(-0.6, -0.1)[3:5] == (0, 1)
    assert len(met(-0.6, -0.1).values) == 0
    other = met(-0.6, -0.1, 0.5, 0.8, others=((4 * STEP, 1, -1),))
    assert (len(other.values), other.unfinished) == (0, 1)


def test_who_lets_disks_pass_as_if_nothing_were_there_is_caught():
    one, truth = truth_of("head_on_equal_e1")
    ghost = replace(
        truth,
        position=one.scene.position + truth.t[:, None, None] * one.scene.velocity,
        velocity=np.broadcast_to(one.scene.velocity, truth.velocity.shape).copy(),
    )
    passed, sound = (beside_truth(one, one.dt(1), each, truth) for each in (ghost, truth))
    for metric, least in (
        ("penetration_radii", 0.5),
        ("velocity_max", 0.5),
        ("position_max_radii", 1.0),
    ):
        caught, right = METRICS[metric].of(passed), METRICS[metric].of(sound)

        assert caught is not None
        assert right is not None
        assert caught.value > least
        assert right.value < 1e-9


@pytest.mark.parametrize("substeps", [1, 2])
def test_box2d_is_not_read_while_two_still_approach(substeps: int, monkeypatch: pytest.MonkeyPatch):
    # Its slow collisions have e = 0 as shipped, not e = -0.84, which is what the first sample says.
    one = scenario("line_gas")
    row = ENGINES["box2d_v3:shipped"]
    run = play(row.make(), "box2d_v3:shipped", one, one.dt(substeps))
    assert run.trajectory is not None
    found = METRICS["restitution_error"].of(
        View(one, run.dt, run.trajectory, rounding=row.rounding)
    )

    assert found is not None
    assert found.value == pytest.approx(1.0, abs=1e-6)  # float32
    assert found.note.endswith(" not over")
    monkeypatch.setattr(restitution, "approach", nothing_approaches)
    found = METRICS["restitution_error"].of(
        View(one, run.dt, run.trajectory, rounding=row.rounding)
    )
    assert found is not None
    assert found.value > 1.1


def test_a_disk_that_is_pressed_through_the_floor_has_no_restitution():
    # In a column that the lesson's solver cannot carry gravity does more than the collision; the
    # overlap is seen. Only the one that jumps out and lands beside it is read.
    one = scenario("column_of_ten")
    run = play(ENGINES["reference:lesson"].make(), "reference:lesson", one, one.dt(1))
    assert run.trajectory is not None
    view = View(one, run.dt, run.trajectory)
    found, overlap, through = (
        METRICS[metric].of(view)
        for metric in ("restitution", "penetration_radii", "disks_tunnelled")
    )

    assert found is not None
    assert found.note.startswith("1 collisions read, ")
    assert found.note.endswith(" 7 not over")
    assert overlap is not None
    assert overlap.value > 0.5
    assert through is not None
    assert through.value > 0
