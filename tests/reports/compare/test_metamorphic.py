"""Every metric changes as its unit says if the same is stated otherwise: numbers of disks, axes,
origin, units, walls.

Nothing else may change a number, not by more than rounding, and not by the rounding of a grid on
which steps, samples and collisions lie together.
"""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare import collisions, delays, laws, view
from crosscheck2d.reports.compare.comparison import compare
from crosscheck2d.reports.compare.metrics import METRICS, Metric
from crosscheck2d.reports.compare.scales import momentum
from crosscheck2d.reports.compare.verdicts import VERDICTS
from crosscheck2d.reports.compare.view import Value, View
from crosscheck2d.scenarios.families.placing import box, lay_out
from crosscheck2d.scenarios.files.scene_file import read_scene_file
from crosscheck2d.scenarios.model import Scenario, Scene, Thrust
from crosscheck2d.scenarios.truth.exact import with_oracle
from tests.reports.compare.answers import run_engines
from tests.reports.compare.metamorphic import CHANGES, Change

PLAYED = (
    *("reference:exercise", "reference:ordered", "event_driven:float64"),
    *("pymunk:matched", "box2d:matched"),
)
ROOM = box([-2.5, -2.5], [2.5, 2.5])


def asked(
    name: str, scene: Scene, duration: float, interval: float, thrusts: tuple[Thrust, ...] = ()
) -> Scenario:
    return with_oracle(Scenario(name, "?", "", scene, duration, interval, (1, 2), thrusts))


def crowd(**more: object) -> Scene:
    return lay_out(
        position=[[-1.5, 1.7], [-2.2, -0.4], [-0.6, 0.1], [0.5, 1.3], [1.2, -1.1]],
        velocity=[[2.35, -1.51], [1.17, 0.64], [-0.75, -2.45], [-0.96, -2.59], [-1.76, 1.78]],
        radius=[0.17, 0.27, 0.25, 0.34, 0.4],
        mass=[2.6, 2.1, 0.8, 1.6, 2.4],
        angle=[0.1, 1.2, -2.0, 0.0, 0.3],
        angular_velocity=[0.4, -1.0, 0.0, 2.0, 0.7],
        **more,
    )


SCENES: dict[str, Callable[[], Scenario]] = {
    "free": lambda: asked("free", crowd(restitution=0.8), 1.0, 0.02),
    "elastic": lambda: asked("elastic", crowd(restitution=1.0, walls=ROOM), 1.5, 0.02),
    "room": lambda: asked("room", crowd(restitution=0.9, walls=ROOM), 1.0, 0.02),
    "falling": lambda: asked(
        "falling", crowd(restitution=0.5, walls=ROOM, gravity=[0.3, -9.81]), 0.8, 0.02
    ),
    # Every collision at the end of a step and of a sample interval; the walls in many pieces of
    # decimal lengths.
    "grid": lambda: asked(
        "grid",
        lay_out(
            position=[[-0.5, 0.0], [0.5, 0.0], [0.0, 1.0], [0.0, -1.0]],
            velocity=[[1.0, 0.0], [-1.0, 0.0], [0.0, 2.0], [0.0, 0.0]],
            radius=0.1,
            mass=[1.0, 1.0, 2.0, np.inf],
            walls=box([-1.1, -1.7], [1.1, 1.7]),
        ),
        3.0,
        0.1,
    ),
    "thrust": lambda: asked(
        "thrust",
        crowd(restitution=0.8),
        1.0,
        0.02,
        (Thrust(0, 0.1, 0.5, [1.5, -2.0], 0.3), Thrust(3, 0.2, 0.77, [0.0, 4.0])),
    ),
    "thrust to the walls": lambda: asked(
        "steered",
        crowd(restitution=0.7, walls=ROOM),
        0.8,
        0.02,
        (Thrust(1, 0.0, 0.6, [3.0, 0.5], 0.3, "body"),),
    ),
    "wrapped": lambda: asked(
        "wrapped", crowd(restitution=0.9, wrap=[[-3.0, -2.0], [3.0, 2.0]]), 1.0, 0.02
    ),
    # One slides on the floor until it rolls, the other bounces.
    "rough": lambda: asked(
        "rough",
        lay_out(
            position=[[0.0, 0.25], [3.0, 1.0]],
            velocity=[[1.0, 0.0], [1.5, 0.0]],
            radius=[0.25, 0.5],
            mass=[1.0, 2.0],
            angular_velocity=[0.0, 3.0],
            restitution=0.5,
            friction=0.2,
            walls=[[[-2.0, 0.0], [9.0, 0.0]]],
            gravity=[0.0, -9.81],
        ),
        0.7,
        0.02,
    ),
}

# What a change cannot be asked of: a moving frame moves walls, what stands still and gravity's
# energy; the wrap stands along the axes and is as long as it is.
WALLED = ("elastic", "room", "falling", "grid", "thrust to the walls", "wrapped", "rough")
LEFT_OUT = {("boosted", name) for name in WALLED} | {
    (name, "wrapped") for name in ("turned", "turned by a quarter and mirrored")
}
# Numbers that belong to a frame: energies and the spin of the whole about a point are others in a
# moving one.
OF_A_FRAME = (
    *("energy_error", "energy_deviation", "energy_created", "energy_loss_error"),
    "angular_momentum_error",
)

ROUNDING = 1e-9
"""Of a number, and of the size of what it is the difference of: float64 of some ten roundings, in
coordinates of 40 m where lengths are of 1 m, spread a hundredfold by restitutions read off small
changes of velocity."""


@cache
def played(name: str) -> tuple[Scenario, tuple[Run, ...], pd.DataFrame]:
    one = SCENES[name]()
    runs = tuple(run for run in run_engines(one, *PLAYED) if run.status == "ok")
    return one, runs, compare(one, runs).table


def wrong(name: str, change: Change) -> list[str]:
    one, runs, before = played(name)
    new = change.scenario(one)
    after = compare(new, [change.run(run, one) for run in runs]).table
    assert before.metric.tolist() == after.metric.tolist()
    moved, found = any(change.boost), []
    frame = momentum(one) / momentum(new)
    for a, b in zip(before.itertuples(), after.itertuples()):
        if moved and a.metric in OF_A_FRAME:
            continue
        factor = frame if moved and a.metric.startswith("momentum") else change.factor(a.unit)
        near = ROUNDING * factor * max(abs(a.value), 1.0)
        same = a.value * factor == b.value or abs(a.value * factor - b.value) <= near
        same |= bool(np.isnan(a.value) and np.isnan(b.value))
        if not same:
            found.append(
                f"{a.metric} {a.engine} {a.dt_s:g} {a.versus}: {a.value * factor!r} is {b.value!r}"
                f" {b.note}"
            )
    return found


CAN = {change: [name for name in SCENES if (change, name) not in LEFT_OUT] for change in CHANGES}
# Every change and every scene is in the quarter that is played here; the long test has the others.
PAIRS = [
    pytest.param(
        name, change, marks=[] if j % 4 == k % min(4, len(CAN[change])) else [pytest.mark.long]
    )
    for k, change in enumerate(CHANGES)
    for j, name in enumerate(CAN[change])
]


@pytest.mark.parametrize(("name", "change"), PAIRS)
def test_every_metric_changes_as_its_unit_says(name: str, change: str):
    assert not wrong(name, CHANGES[change])


def test_every_metric_is_under_test():
    tables = [played(name)[2] for name in SCENES]
    assert {*pd.concat(tables).metric} - {*VERDICTS} == {*METRICS}
    for metric in METRICS:
        values = np.concatenate([table[table.metric == metric].value for table in tables])
        assert (np.isfinite(values) & (values != 0)).any() or metric == "disks_tunnelled", metric


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    length=st.floats(1e-4, 1e4),
    time=st.floats(1e-4, 1e4),
    mass=st.floats(1e-4, 1e4),
    turn=st.floats(0, 7),
    flip=st.sampled_from([1, -1]),
    name=st.sampled_from(["free", "falling", "grid", "thrust"]),
)
def test_any_units_and_any_axes_will_do(
    length: float, time: float, mass: float, turn: float, flip: int, name: str
):
    assert not wrong(name, Change(length=length, time=time, mass=mass, turn=turn, flip=flip))


def three_steps_away(view: View) -> int:
    near = np.abs(view.played.t[:, None] - view.played.collisions.t).min(axis=1, initial=np.inf)
    return (near > 3 * view.dt).sum()


def offset(view: View) -> np.ndarray:
    return view.played.position - view.other.position


# What should not be a metric: its unit, and the number.
WRONG_METRICS: dict[str, tuple[str, Callable[[View], float]]] = {
    "samples further than 3 dt from each collision": ("1", three_steps_away),
    "disks off by more than 1 mm": (
        "disks",
        lambda view: (view.deviation > 1e-3).any(axis=0).sum(),
    ),
    "first disk off": ("m", lambda view: view.deviation[:, 0].max()),
    "off along x": ("m", lambda view: np.abs(offset(view)[..., 0]).max()),
    "off to the top": ("m", lambda view: offset(view)[..., 1].max()),
    "distance from the origin": ("m", lambda view: laws.lengths(view.played.position).max()),
    "collisions per second": ("1", lambda view: len(view.played.collisions) / view.played.t[-1]),
    "walls": ("1", lambda view: len(view.scene.walls)),
    "disks of more than 2 kg": ("1", lambda view: (view.scene.mass > 2).sum()),
    "largest radius": ("1", lambda view: view.scene.radius.max()),
    "thrusts": ("1", lambda view: len(view.scenario.thrusts)),
    "fastest": ("m/s", lambda view: np.abs(view.played.velocity).max()),
}
WRONG = [
    ("samples further than 3 dt from each collision", "grid", "ten times as fast"),
    ("disks off by more than 1 mm", "room", "in km"),
    ("first disk off", "room", "permuted"),
    ("first disk off", "room", "rolled"),
    ("off along x", "room", "turned"),
    ("off to the top", "room", "mirrored"),
    ("off to the top", "room", "turned by a quarter and mirrored"),
    ("distance from the origin", "room", "shifted"),
    ("collisions per second", "room", "a third as fast"),
    ("collisions per second", "room", "in ms"),
    ("collisions per second", "room", "in feet, minutes and pounds"),
    ("walls", "room", "walls cut in two"),
    ("collisions per second", "room", "walls doubled"),
    ("disks of more than 2 kg", "room", "in g"),
    ("largest radius", "room", "in mm"),
    ("thrusts", "thrust", "thrusts cut in two"),
    ("thrusts", "thrust", "thrusts shared by two"),
    ("fastest", "free", "boosted"),
]


@pytest.mark.parametrize(("metric", "name", "change"), WRONG)
def test_a_metric_that_should_not_be_one_is_caught(
    metric: str, name: str, change: str, monkeypatch: pytest.MonkeyPatch
):
    unit, number = WRONG_METRICS[metric]
    wrong_metric = Metric(lambda view: Value(float(number(view))), unit, ("truth",))
    monkeypatch.setitem(METRICS, "wrong", wrong_metric)
    rows = wrong_again(name, change)
    assert rows
    assert [row for row in rows if not row.startswith("wrong ")] == []


def test_there_is_a_control_for_every_change():
    assert {change for *_, change in WRONG} == {*CHANGES}


def test_a_bound_on_the_grid_is_caught_in_the_metrics_themselves(monkeypatch: pytest.MonkeyPatch):
    # what is compiled keeps its bounds
    monkeypatch.setattr(collisions, "judge", collisions.judge.py_func)
    for module in (delays, view, collisions):
        monkeypatch.setattr(module, "WINDOW", 3.0)
    assert wrong_again("room", "ten times as fast")
    monkeypatch.undo()
    for module in (delays, collisions):
        monkeypatch.setattr(module, "SAME", 0.0)
    assert wrong_again("grid", "in ms")


def wrong_again(name: str, change: str) -> list[str]:
    played.cache_clear()
    try:
        return wrong(name, CHANGES[change])
    finally:
        played.cache_clear()


CASES = Path(__file__).parents[3] / "tests" / "data" / "scenes"


def test_a_scene_ten_times_as_fast_gives_the_same_numbers_in_its_own_file():
    # Two files that are one scene, played each: here engines are asked as well. Those without a
    # unit of time: pymunk takes as much of an overlap away in a second, whatever a second is.
    tables = []
    for name in ("pace_1", "pace_10"):
        one = read_scene_file(CASES / f"{name}.toml")
        solvers = ("reference:exercise", "reference:lesson", "reference:ordered")
        tables.append(compare(one, run_engines(one, *solvers, "event_driven:float64")).table)
    slow, fast = tables
    assert slow.metric.tolist() == fast.metric.tolist()
    factor = slow.unit.map({"m/s": 10.0, "rad/s": 10.0, "s": 0.1}).fillna(1.0)
    # Chaos spreads the rounding of the velocities a millionfold by the end, as the horizon of the
    # scene says.
    np.testing.assert_allclose(fast.value, slow.value * factor, rtol=1e-8, atol=1e-9)
