"""The horizon ends where rounding decides the order of collisions, and only there."""

from __future__ import annotations

import numpy as np
import pytest

from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Array, Scenario, Scene
from crosscheck2d.scenarios.truth.exact import computed
from crosscheck2d.scenarios.truth.record import TruthRecord

MEET = 1 - 0.25 / np.cos(np.pi / 6)  # s, when three disks of radius 0.25 m meet at the origin
UNDECIDED = "rounding decides the order of the collisions of disk"


def record_of_scene(scene: Scene, duration: float = 2.0) -> TruthRecord:
    return computed(Scenario("asked", "?", "", scene, duration, duration / 40))


def three(turn: float, late: tuple[float, float, float] = (0, 0, 0), mass: float = 1.0) -> Scene:
    """Three disks that fly to the origin from 1 m at 1 m/s, each `late` s later; disk 0 has another
    mass."""
    angle = turn + 2 * np.pi / 3 * np.arange(3)
    way = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return lay_out((1 + np.array(late)[:, None]) * way, -way, mass=[mass, 1.0, 1.0])


def turned(points: list[list[float]], turn: float) -> Array:
    return np.array(points) @ [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]


def wall_and_disk(turn: float, late: float = 0.0) -> Scene:
    """Disk 0 meets a wall at 1.75 s, and so does disk 1 with disk 0, from a slant, `late` s
    later."""
    slant = 0.5 * np.array([np.cos(0.9), np.sin(0.9)])
    velocity = np.array([[0.0, -1.0], [-1.0, -0.75]])
    meet = np.array([[0.0, 0.25], [0.0, 0.25] + slant])
    return lay_out(
        turned((meet - [[1.75], [1.75 + late]] * velocity).tolist(), turn),
        turned(velocity.tolist(), turn),
        mass=[1.0, 2.0],
        walls=[turned([[-5.0, 0.0], [5.0, 0.0]], turn)],
    )


def corner(turn: float, restitution: float) -> Scene:
    return lay_out(
        turned([[2.0, 2.0]], turn),
        turned([[-1.0, -1.0]], turn),
        restitution=restitution,
        walls=[turned([[0, 0], [5, 0]], turn), turned([[0, 5], [0, 0]], turn)],
    )


@pytest.mark.parametrize("turn", [0.0, 0.7318, 2.5])
@pytest.mark.parametrize("mass", [1.0, 3.0])
def test_three_disks_that_meet_at_a_point_have_no_answer_after_that(turn: float, mass: float):
    record = record_of_scene(three(turn, mass=mass))

    assert record.horizon == pytest.approx(MEET, rel=1e-12)
    assert record.reason.startswith(f"{UNDECIDED}s 0, 1, 2, and the outcome depends on it")
    assert len({*record.outcomes[:, 0]}) == len({*record.orders[:, 0]}) > 1
    assert record.remains


@pytest.mark.parametrize("turn", [0.0, 0.7318])
def test_a_wall_and_a_disk_met_at_once_have_no_answer_after_that(turn: float):
    record = record_of_scene(wall_and_disk(turn), 3.0)

    assert record.horizon == pytest.approx(1.75, rel=1e-12)
    assert record.reason.startswith(f"{UNDECIDED}s 0, 1, and the outcome depends on it")


@pytest.mark.parametrize("turn", [0.0, 0.7318])
def test_collisions_a_microsecond_apart_keep_their_horizon(turn: float):
    for scene, least in ((three(turn, (0, 1e-6, 3e-6)), 3), (wall_and_disk(turn, 1e-6), 2)):
        record = record_of_scene(scene, 3.0)
        assert (record.horizon, record.float64_horizon, record.reason) == (np.inf, np.inf, "")
        assert len(record.events) >= least


def test_collisions_that_their_order_does_not_change_keep_their_horizon():
    for turn in (0.0, 0.7318):
        for restitution in (0.5, 1.0):
            assert record_of_scene(corner(turn, restitution)).horizon == np.inf
    row = lay_out(
        [[-2.0, 0.0], [0.0, 0.0], [0.5 + 1e-16, 0.0], [1.0 + 3e-16, 0.0], [3.0, 0.0]],
        [[1.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [-1.0, 0.0]],
    )
    assert record_of_scene(row, 4.0).horizon == np.inf
