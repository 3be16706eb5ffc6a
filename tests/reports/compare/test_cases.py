"""Scenes in which a metric was misleading, with the value that is right."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare import laws, scales
from crosscheck2d.reports.compare.comparison import Comparison
from crosscheck2d.reports.compare.delays import jumps_of
from crosscheck2d.reports.compare.fast_disks import fast_note
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.restitution import Restitutions
from crosscheck2d.reports.compare.view import NOT_JUDGED, Value, View, beside
from crosscheck2d.scenarios import catalogue
from crosscheck2d.scenarios.files.scene_file import read_scene_file
from crosscheck2d.scenarios.model import Collisions, Scenario, Thrust, Trajectory
from crosscheck2d.scenarios.no_truth import answered
from tests.reports.compare.answers import beside_truth, one_disk, run_alone, run_engine, truth_of

CASES = Path(__file__).parents[2] / "data" / "cases"
STOPPED = 1e-6  # e of a float32 engine that stops a disk: its rounding of a velocity
PLAYED = [name for name, row in ENGINES.items() if not row.package and "coulomb" not in name]


@cache
def case(name: str) -> Scenario:
    return answered(read_scene_file(CASES / f"{name}.toml"))[0]


@cache
def played(name: str, engine: str, rung: int = 0) -> Run:
    scenario = case(name)
    return run_engine(scenario, engine, scenario.substeps[rung])


def read(metric: str, name: str, engine: str, rung: int = 0) -> Value:
    """The metric of that run, against the exact answer if it is measured against nothing else."""
    scenario, run = case(name), played(name, engine, rung)
    truth = answered(scenario)[1] if "itself" not in METRICS[metric].against else None
    jumps = None if truth is None else jumps_of(truth, scenario)
    return METRICS[metric].of(beside(scenario, run, truth, jumps))


@pytest.mark.parametrize("metric", ["position_rms", "position_rms_radii", "angle_rms"])
@pytest.mark.parametrize("engine", ["reference:exercise", "box2d:shipped", "pymunk:matched"])
def test_disks_that_cannot_move_count_in_no_mean(metric: str, engine: str):
    # Eight static disks far away divided the error by three.
    alone, among = (read(metric, name, engine) for name in ("rms-alone", "rms-with-static"))

    assert among.value == alone.value
    assert alone.value > 0 or metric == "angle_rms"


@pytest.mark.parametrize("rung", [0, 1, 2])
@pytest.mark.parametrize("engine", ["event_driven:float64", "reference:ordered", "pymunk:matched"])
def test_a_disk_that_lands_and_lies_has_no_restitution(engine: str, rung: int):
    assert read("restitution", "sinks_in", engine, rung).value == pytest.approx(0, abs=1e-15)
    assert read("restitution_error", "sinks_in", engine, rung).value < 1e-15


@pytest.mark.parametrize("engine", ["event_driven:float64", "reference:ordered", "pymunk:matched"])
def test_a_disk_that_lands_just_before_the_end_has_no_restitution(engine: str):
    # It lands at 1.01 of 1.05 s; nothing after the last sample tells that it lies.
    higher = replace(case("sinks_in").scene, position=[[0.0, 0.5 + 5.1005]])
    early = replace(case("sinks_in"), scene=higher, truth=None, duration=1.05, substeps=(4,))
    value = METRICS["restitution"].of(run_alone(early, engine, 4))
    assert value.value == pytest.approx(0, abs=1e-15)


def test_a_disk_that_bounces_as_low_is_told_from_one_that_lies():
    scenario = case("sinks_in")
    bouncing = replace(scenario, scene=replace(scenario.scene, restitution=0.15))
    run = run_engine(bouncing, "reference:ordered", 6)
    value = METRICS["restitution"].of(beside(scenario, run, None, None))

    assert 0.14 < value.value < 0.16


@pytest.mark.parametrize("engine", PLAYED)
def test_every_engine_has_a_restitution(engine: str):
    for rung in range(3):
        slow, pong = (
            read("restitution", name, engine, rung).value
            for name in ("slow_diagonal", "shallow_pong")
        )
        sticks = engine in ("box2d:shipped", "box2d_v3:shipped")
        assert slow == pytest.approx(0.0 if sticks else 1.0, abs=1e-5)
        assert pong == pytest.approx(0.0 if sticks else 1.0, abs=1e-5)


def test_no_median_stands_for_collisions_of_which_some_bounce():
    value = read("restitution", "shallow_pong", "box2d:shipped")

    assert value.note.startswith("3 of 4 bounce, e from 0 to 1, ")


@pytest.mark.parametrize(
    ("values", "stated", "right", "note"),
    [
        ([0, 0, 1, 1], 1.0, 0.0, "2 of 4 bounce, e from 0 to 1, "),
        ([0, 0, 1, 1], 0.3, 1.0, "2 of 4 bounce, e from 0 to 1, "),
        ([0, 0.5, 0.5, 0.6], 0.5, 0.0, "3 of 4 bounce, e from 0 to 0.6, "),
        ([0] + [1] * 19, 1.0, 1.0, "19 of 20 bounce, e from 0 to 1, "),
        ([0.4, 0.5, 0.6], 0.5, 0.5, ""),
        ([0, 0, 0], 0.9, 0.0, ""),
    ],
)
def test_the_group_that_departs_more_is_the_value(
    values: list[float], stated: float, right: float, note: str
):
    scenario = case("shallow_pong")
    scenario = replace(scenario, scene=replace(scenario.scene, restitution=stated))
    trajectory = played("shallow_pong", "reference:ordered").trajectory
    view = View(scenario, 0.1, trajectory)
    none = np.zeros(len(values))
    view.__dict__["restitutions"] = Restitutions(np.array(values, float), none, none, 0, 0)
    value = METRICS["restitution"].of(view)

    assert value.value == right
    assert value.note == f"{note}{len(values)} collisions read"


def test_apex_heights_say_who_bounces_higher():
    # Percent a bounce: as shipped pymunk keeps its apex, matched it comes higher by what it is
    # moved out of the floor; Box2D 3.1 loses 1.2 % in all.
    assert read("apex_change", "higher", "pymunk:shipped", 1).value == pytest.approx(0, abs=1e-9)
    assert read("apex_change", "higher", "pymunk:matched").value == pytest.approx(0.18, abs=0.01)
    assert read("apex_change", "higher", "event_driven:float64").value == pytest.approx(0, abs=1e-9)
    lost = read("apex_change", "higher", "box2d_v3:matched")
    assert -0.3 < lost.value < -0.2
    assert lost.note.endswith("in all -1.2 %")
    gains = read("apex_change", "higher", "reference:lesson")
    assert 1.5 < gains.value < 2


def dropped(e: float, stated: float, gravity: tuple[float, float] = (0.0, -10.0)) -> Value | None:
    """`apex_change` of a disk that bounces exactly with e, of a scene that states another, on a
    floor at right angles to gravity."""
    up = -np.array(gravity) / np.hypot(*gravity)
    along = np.array([-up[1], up[0]])
    floor = [[-20 * along, 20 * along]]
    scene = one_disk(
        3 * up, 0.5 * along, e, radius=[0.25], mass=[2.0], gravity=gravity, walls=floor
    )
    scenario = Scenario("drop", "?", "here", scene, 4.0, 1 / 60)
    run = run_engine(scenario, "reference:ordered")
    return METRICS["apex_change"].of(
        beside(replace(scenario, scene=replace(scene, restitution=stated)), run, None, None)
    )


@pytest.mark.parametrize("gravity", [(0.0, -10.0), (3.0, -4.0), (9.81, 0.0)])
def test_a_disk_that_does_not_bounce_loses_all_its_height(gravity: tuple[float, float]):
    # -100 %; one with the e that is stated 0, one with another (e / stated)2 - 1.
    for e, stated, change in ((0, 1, -100), (0.7, 0.7, 0), (0.8, 1, -36), (1, 0.8, 56.25)):
        value = dropped(e, stated, gravity)

        assert value.value == pytest.approx(change, abs=1e-6)


def test_no_apex_is_read_off_a_tilted_floor():
    slope = [[[-20, -2], [20, 2]]]
    scene = one_disk([0, 3], radius=[0.25], gravity=[0, -10], walls=slope)
    scenario = Scenario("tilted", "?", "here", scene, 2.0, 1 / 60)

    assert METRICS["apex_change"].of(run_alone(scenario, "reference:ordered")) is None


@pytest.mark.parametrize("rung", [1, 2])
def test_velocities_half_a_step_off_create_no_energy(rung: int):
    assert read("energy_created", "higher", "pymunk:shipped", rung).value < 1e-13
    assert read("energy_created", "higher", "reference:lesson", rung).value > 0.02


def test_an_error_of_energy_has_a_sign_in_its_note():
    assert read("energy_error", "higher", "box2d_v3:matched").note == "lost"
    assert read("energy_error", "higher", "reference:lesson").note == "gained"


@pytest.mark.parametrize("engine", PLAYED)
def test_a_disk_that_wraps_does_not_cross_the_box(engine: str):
    for rung in range(3):
        assert read("disks_tunnelled", "wrap_wall", engine, rung).value == 0


@pytest.mark.parametrize(
    ("path", "through"),
    [
        ([0.5, 0.1, -0.3], True),  # the wall at 0
        ([1.7, 1.99, -1.8, -1.5], False),  # across the edge
        ([1.7, 1.99, -1.4], True),  # across the edge and the wall at -1.5 behind it
        ([-1.4, 1.9], True),  # the other way
    ],
)
def test_a_wall_of_a_torus_is_crossed_on_the_way_that_a_disk_takes(
    path: list[float], through: bool
):
    scene = replace(
        case("wrap_wall").scene, walls=np.array([[[0, -1], [0, 1]], [[-1.5, -1], [-1.5, 1]]])
    )
    x = np.array([[[at, 0.0]] for at in path])
    still = np.zeros((len(path), 1))
    moved = Trajectory(np.arange(len(path)) * 0.1, x, np.zeros_like(x), still, still)

    assert bool(laws.wall_crossings(moved, scene)) is through


def test_a_spin_is_judged_only_where_it_is_compared():
    # Every sample of the coarsest run is near a collision: 0 of all of them said nothing.
    for engine in ("box2d:shipped", "pymunk:matched", "event_driven:float64"):
        coarse = read("angular_velocity_max", "spin_channel", engine)
        assert np.isnan(coarse.value)
        assert coarse.note == f"{NOT_JUDGED}: only 0 of 100 samples"
    finer = read("angular_velocity_max", "spin_channel", "box2d:shipped", 1)
    assert 36 < finer.value < 41
    assert finer.note == "19 of 100 samples"


@pytest.mark.parametrize(
    "scale", [scales.momentum, scales.angular_momentum, scales.energy], ids=lambda of: of.__name__
)
def test_no_scale_grows_with_the_duration(scale: object):
    assert callable(scale)
    assert scale(case("oblique_2s")) == scale(case("oblique_20s"))


def test_an_error_of_angular_momentum_is_the_same_however_long_the_scene():
    # Of an engine that makes it in the collision; rounding, times a longer lever, is below 1 %.
    short, long = (
        read("angular_momentum_error", name, "box2d_v3:matched").value
        for name in ("oblique_2s", "oblique_20s")
    )
    assert short > 1e-3
    assert long == pytest.approx(short, rel=0.01)


def test_the_energy_at_hand_is_what_a_disk_can_lose():
    ball = catalogue.scenario("bouncing_ball_e09")
    assert scales.energy(ball) == pytest.approx(1.0 * 9.81 * (1.36 - 0.25))
    assert scales.energy(replace(ball, duration=1.0)) == scales.energy(ball)
    still = replace(ball.scene, gravity=np.zeros(2), velocity=np.array([[3.0, 0.0]]))
    spun = replace(ball, scene=still, thrusts=[Thrust(0, 0.0, 2.0, np.zeros(2), 0.125)])
    assert scales.energy(spun) == pytest.approx(4.5 + 0.03125 * 8.0**2 / 2)
    lies = replace(ball, scene=replace(ball.scene, position=np.array([[0.0, 0.25]])))
    assert scales.energy(lies) == pytest.approx(9.81 * 0.25)


def test_a_floor_along_which_a_disk_rolls_is_no_wall_that_it_can_pass():
    for velocity, passes in (([30.0, 0.0], False), ([0.0, -30.0], True)):
        scene = one_disk([0, 2], velocity, radius=[1], walls=[[[-90, 1], [90, 1]]])
        fast = Scenario("fast", "?", "here", scene, 1.0, 0.1, (1, 2), without_truth="not needed")
        table = Comparison(fast, None, (), None)  # type: ignore[arg-type]

        assert bool(fast_note(table)) is passes


def test_a_collision_found_forty_steps_late_is_counted_in_the_note():
    one, truth = truth_of("head_on_equal_e05")
    met, dt = truth.collisions, one.dt(8)
    late = replace(truth, collisions=Collisions(met.t + 40 * dt, met.i, met.j, met.impulse))
    found, control = (
        METRICS["collisions_missed"].of(beside_truth(one, dt, played, truth))
        for played in (late, truth)
    )

    assert (found.value, control.value) == (0, 0)
    assert found.note == f"{control.note}, 1 found more than 20 steps late or early"
