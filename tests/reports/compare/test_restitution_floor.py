"""Restitution is read off what stands above the rounding of an engine, and not off its noise."""

import numpy as np
import pytest

from crosscheck2d.adapters.engine_row import FLOAT32, FLOAT64
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.compare import restitution
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.restitution import FLOOR, effective_restitution
from crosscheck2d.reports.compare.view import Value, View
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.model import Collisions, Scene, Trajectory

WALLS = [[[-10.0, 0.0], [10.0, 0.0]]]


def sliding(change: float, speed: float = 0.5, e: float = 0.5) -> tuple[Trajectory, Scene]:
    """A disk that slides along a floor at `speed` m/s and has one collision with it, of a `change`
    in m/s."""
    scene = Scene(
        position=[[0, 0.1]],
        velocity=[[speed, 0]],
        radius=[0.1],
        mass=[1],
        restitution=e,
        walls=WALLS,
    )
    t = np.arange(4.0)
    down, up = -change / (1 + e), change * e / (1 + e)
    velocity = np.array([[[speed, down]], [[speed, down]], [[speed, up]], [[speed, up]]])
    still = np.zeros((4, 1))
    collisions = Collisions.of([(1.5, 0, -1, np.nan)])
    return Trajectory(t, np.zeros((4, 1, 2)), velocity, still, still, collisions), scene


@pytest.mark.parametrize("rounding", [FLOAT32, FLOAT64])
@pytest.mark.parametrize("speed", [0.5, 500.0])
def test_the_floor_is_the_rounding_of_the_velocities(rounding: float, speed: float):
    floor = FLOOR * rounding * 2 * speed  # before and after
    for factor, counts in ((10, (1, 0)), (0.1, (0, 1))):
        found = effective_restitution(*sliding(factor * floor, speed), 1.0, 0.0, rounding)

        assert (len(found.values), found.below) == counts
        # The normal is that of the change, with a sliver of the rounding of nothing else: e as it
        # was put in.
        assert found.values == pytest.approx([0.5] * counts[0], rel=1e-9)


def test_a_heavy_disk_that_hardly_notices_is_read():
    # Its own speed is what its change stands above: a millionth of the light disk's.
    scene = Scene(
        position=[[0, 0], [1, 0]],
        velocity=[[0, 0], [-1, 0]],
        radius=[0.1] * 2,
        mass=[1e7, 1],
        restitution=1,
    )
    t, still = np.arange(4.0), np.zeros((4, 2))
    light, heavy = [-1.0, -1.0, 1.0, 1.0], [0.0, 0.0, -2e-7, -2e-7]
    velocity = np.stack([np.stack([heavy, still[:, 0]], 1), np.stack([light, still[:, 0]], 1)], 1)
    played = Trajectory(
        t, np.zeros((4, 2, 2)), velocity, still, still, Collisions.of([(1.5, 0, 1, 2.0)])
    )
    found = effective_restitution(played, scene, 1.0, 0.0, FLOAT32)

    assert found.below == 0
    # 2e-7, by which the heavy one is faster than at rest
    assert found.values == pytest.approx([1.0], abs=1e-6)


def read(name: str, engine: str, substeps: int) -> dict[str, Value | None]:
    """The two metrics of restitution of a run."""
    one = scenario(name)
    run = play(ENGINES[engine].make(), engine, one, one.dt(substeps))
    assert run.trajectory is not None
    view = View(one, run.dt, run.trajectory, rounding=ENGINES[engine].rounding)
    return {metric: METRICS[metric].of(view) for metric in ("restitution", "restitution_error")}


@pytest.mark.parametrize(
    ("name", "substeps"), [("gas_of_100", 1), ("box_billiard", 1), ("box_billiard", 2)]
)
def test_a_contact_that_lasts_is_no_collision(name: str, substeps: int):
    # Box2D 3.1 as shipped lets a slow disk stick to a wall (e = 0), and reports a collision
    # whenever it comes nearer again.
    found = read(name, "box2d_v3:shipped", substeps)["restitution_error"]

    assert found is not None
    # the noise of a contact has e = -1, an error of 2
    assert found.value < 1.5


def test_without_the_floor_it_would_be_read_as_minus_one(monkeypatch: pytest.MonkeyPatch):
    # The control: of most of the collisions that are read nothing is left of the velocity but its
    # sign.
    monkeypatch.setattr(restitution, "FLOOR", 0.0)
    found = read("gas_of_100", "box2d_v3:shipped", 1)["restitution_error"]

    assert found is not None
    assert found.value > 1.99


def test_what_is_below_the_floor_is_counted_in_the_note():
    found = read("gas_of_100", "box2d_v3:shipped", 1)
    matched = read("gas_of_100", "box2d_v3:matched", 1)["restitution"]
    galperin = read("galperin_31", "box2d_v3:shipped", 1)["restitution"]

    for value in found.values():
        assert value is not None
        assert " below the floor" in value.note
    assert matched is not None
    assert matched.note.endswith(" collisions read")
    assert galperin is not None
    assert galperin.note == "2 collisions read, 1 below the floor"
