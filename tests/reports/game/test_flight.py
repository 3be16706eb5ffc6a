"""A flight without a server: keys accelerate as the exercise says, the same keys give the same
bits, a saved flight too."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from math import pi, sqrt
from pathlib import Path
from threading import Barrier

import numpy as np
import pytest

from crosscheck2d.adapters.conformance.probe import loaded
from crosscheck2d.adapters.engine import ContactImpulse, Unsupported
from crosscheck2d.adapters.engine_row import EngineRow
from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.host.engine import OwnSolver
from crosscheck2d.adapters.play import play
from crosscheck2d.adapters.run import first_collisions
from crosscheck2d.reports.game.divergence import (
    NEVER,
    WAIT,
    FlightEvent,
    Touches,
    cause_of,
    differing_since,
)
from crosscheck2d.reports.game.flight import (
    EARTH,
    FRAME,
    SHIP,
    Flight,
    Flyer,
    field_scenario,
    free_place,
)
from crosscheck2d.scenarios.families.exercise import SHIP as START
from crosscheck2d.scenarios.files.scene_file import read_scene_file, scene_text
from crosscheck2d.scenarios.model import Array, Scene, State
from crosscheck2d.scenarios.no_truth import NoTruth
from crosscheck2d.scenarios.truth.closed_forms import world_thrusts

EVENTS = [  # frame, key, down: a turn, a thrust across it, a renewed thrust, both keys of a pair
    (8, "a", True),
    (24, "w", True),
    (40, "w", True),
    (56, "a", False),
    (72, "w", False),
    (80, "s", True),
    (88, "d", True),
    (96, "w", True),
    (110, "d", False),
    (120, "s", False),
    (130, "w", False),
]


def with_edges(names: Iterable[str]) -> list[str]:
    found = []
    for name in names:
        with suppress(Unsupported), loaded(ENGINES[name], field_scenario().scene):
            found.append(name)
    return found


def flown(
    names: Sequence[str],
    frames: int,
    events: Iterable[tuple[int, str, bool]] = EVENTS,
    **field: float,
) -> Flight:
    flight = Flight(field_scenario(**field), names)  # type: ignore[arg-type]
    for frame, key, down in events:
        flight.advance(frame - flight.frame)
        flight.key(key, down)
    flight.advance(frames - flight.frame)
    return flight


def put_ship(flight: Flight, flyer: Flyer, **values: Array) -> State:
    """The state of an engine, loaded anew with these of its ship."""
    state = flyer.engine.read()
    for name, value in values.items():
        getattr(state, name)[SHIP] = value
    flyer.engine.load(replace(flight.scenario.scene, **vars(state)), flight.dt)
    return state


def bits(flight: Flight) -> list[dict[str, bytes]]:
    return [
        {name: array.tobytes() for name, array in vars(flyer.state).items()}
        for flyer in flight.flyers
    ]


@pytest.mark.parametrize(
    "name", ["reference:exercise", "pymunk:matched", "box2d:matched", "event_driven:float64"]
)
def test_keys_move_the_ship_as_the_exercise_says(name: str):
    flight = flown([name], 160, asteroids=0)
    scenario = flight.saved()
    truth = world_thrusts(scenario.scene, scenario.thrusts, scenario.times).at(-1)
    # Each thrust of T s puts the ship (alpha - 1/2) a dt T off, which it keeps; alpha is the order
    # of the updates.
    thrusting = sum(thrust.stop - thrust.start for thrust in scenario.thrusts if thrust.force.any())
    offset = abs(ENGINES[name].alpha - 0.5) * 0.25 * flight.dt * thrusting
    rounding = ENGINES[name].rounding * 160 * 16 * 4  # one a step, of coordinates up to 4 m
    deviation = np.abs(flight.solid.state.position[SHIP] - truth.position[SHIP]).max()

    assert deviation <= offset + rounding
    assert (
        abs(flight.solid.state.angle[SHIP] - truth.angle[SHIP])
        <= 160 * FRAME * flight.dt + rounding
    )
    assert np.hypot(*(truth.position[SHIP] - START)) > 0.2


def test_a_thrust_keeps_its_direction_while_the_ship_turns():
    flight = flown(["reference:exercise"], 60, EVENTS[:4], asteroids=0)
    thrusts = [thrust for thrust in flight.saved().thrusts if thrust.force.any()]
    size = flight.scenario.scene.mass[SHIP] * 0.25
    headings = [np.arctan2(*thrust.force[::-1]) for thrust in thrusts]

    assert [(thrust.start / FRAME, thrust.stop / FRAME) for thrust in thrusts] == [
        (24, 40),
        (40, 60),
    ]
    assert np.allclose([np.hypot(*thrust.force) for thrust in thrusts], size, rtol=1e-15)
    # alpha'' = 1 rad/s2 since frame 8; symplectic Euler turns dt t / 2 further, and rounds.
    expected = [((frame - 8) * FRAME) ** 2 / 2 for frame in (24, 40)]
    assert np.allclose(headings, expected, atol=flight.dt * 32 * FRAME / 2 + 1e-12)


def test_releasing_either_key_of_a_pair_ends_the_thrust():
    # As in the exercise: S takes over from W, and when S is released no force acts, though W is
    # still held.
    flight = flown(
        ["reference:exercise"], 40, [(0, "w", True), (10, "s", True), (20, "s", False)], asteroids=0
    )
    first, second = flight.saved().thrusts

    assert (first.force == -second.force).all()
    assert [first.stop / FRAME, second.stop / FRAME] == [10, 20]


def test_the_same_keys_give_the_same_flight():
    one, two, other = (flown(list(ENGINES)[:3], 200, seed=seed) for seed in (3, 3, 4))

    assert bits(one) == bits(two)
    assert bits(one) != bits(other)


@pytest.mark.parametrize("substeps", [2, pytest.param(16, marks=pytest.mark.long)])
def test_a_saved_flight_replays_to_the_same_bits(tmp_path: Path, substeps: int):
    names = with_edges(ENGINES)
    flight = flown(names, 150, substeps=substeps)
    path = tmp_path / "flight.toml"
    path.write_text(scene_text(flight.saved()))
    scenario = read_scene_file(path)
    again = Flight(scenario, names, replayed=True)
    again.advance(1000)
    runs = [play(ENGINES[name].make(), name, scenario, again.dt) for name in names]

    assert again.frame == 150
    assert [flyer.left for flyer in flight.flyers] == [""] * len(names)
    assert bits(again) == bits(flight)
    for run, state in zip(runs, bits(flight)):
        assert run.trajectory is not None
        assert {
            name: array.tobytes() for name, array in vars(run.trajectory.at(-1)).items()
        } == state


def steered_home() -> list[tuple[int, str, bool]]:
    """Keys that bring the ship from its start to rest at the earth: half a turn in, half out,
    thrust, coast, brake."""
    dx, dy = np.array(EARTH) - START
    # t2 = angle: turned up for t, down for t, at 1 rad/s2
    turn = round(sqrt(np.arctan2(dy, dx)) / FRAME)
    burn = 256  # frames: 4 s at 0.25 m/s2, to 1 m/s and 2 m on
    coast = round((np.hypot(dx, dy) - 4.0) / FRAME)
    keys = [("a", turn), ("d", turn), ("w", burn), ("", coast), ("s", burn)]
    events, frame = [], 0
    for key, frames in keys:
        if key:
            events += [(frame, key, True), (frame + frames, key, False)]
        frame += frames
    return events


def test_a_scripted_flight_wins():
    events = steered_home()
    flight = flown(["reference:exercise"], events[-1][0] - 200, events[:-1], asteroids=0)
    on_the_way = flight.won
    flight.advance(200)
    flight.key("s", False)

    assert not on_the_way
    assert flight.won


def test_winning_is_the_exercises_rule_as_written():
    # A squared distance below 0.5, so from 0.707 m on; spin may be as negative as it likes.
    flight = Flight(field_scenario(asteroids=0), ["reference:exercise"])
    state = flight.solid.state
    verdicts = []
    for away, speed, spin in (
        (0.70, 0.0, -5.0),
        (0.71, 0.0, 0.0),
        (0.0, 0.31, 0.0),
        (0.0, 0.32, 0.0),
        (0.0, 0.0, 0.1),
    ):
        state.position[SHIP] = [EARTH[0] + away, EARTH[1]]
        state.velocity[SHIP], state.angular_velocity[SHIP] = [speed, 0.0], spin
        verdicts.append(flight.won)

    assert verdicts == [True, False, True, False, False]


def test_a_ship_that_leaves_is_set_back_to_its_start():
    # Backwards: 1.5 m at 0.25 m/s2 take sqrt(12) s = 222 frames.
    flight = flown(
        ["reference:exercise", "box2d:matched"],
        240,
        [(0, "s", True), (225, "s", False)],
        asteroids=0,
    )

    assert [len(flyer.edges) for flyer in flight.flyers] == [1, 1]
    assert 220 <= flight.left_at <= 223
    assert flight.solid.state.position[SHIP, 0] == pytest.approx(START[0], abs=0.05)
    assert flight.saved().duration == flight.left_at * FRAME
    assert not flight.saved().thrusts[-1].stop > flight.left_at * FRAME


@pytest.mark.parametrize("name", ["reference:exercise", "pymunk:matched"])
def test_a_ship_is_set_back_in_the_step_in_which_it_leaves(name: str):
    flight = flown([name], 222, [(0, "s", True)], asteroids=0)
    while flight.left_at < 0:
        flight.advance()
    # After k steps, velocity first, it is a dt2 k (k + 1) / 2 behind, position first a dt2 k (k -
    # 1) / 2.
    a, first = 0.25 * flight.dt**2 / 2, 1 if ENGINES[name].alpha == 1.0 else -1
    behind = a * np.arange(6000) * (np.arange(6000) + first)
    leaves = int(np.argmax(START[0] - behind < -5.0))
    since = flight.frame * flight.substeps - leaves
    state = flight.solid.state

    assert 0 < since < flight.substeps
    assert state.position[SHIP] == pytest.approx([START[0] - behind[since], START[1]], abs=1e-13)
    assert state.velocity[SHIP] == pytest.approx([-0.25 * since * flight.dt, 0.0], abs=1e-13)


@pytest.mark.parametrize(
    "names",
    [
        ["reference:exercise", "box2d:matched"],
        pytest.param(ENGINES, marks=pytest.mark.long),
    ],
    ids=["two", "all"],
)
def test_looking_at_every_step_near_an_edge_changes_no_bit(names: Iterable[str]):
    # The ship turns round 0.1 m before the edge, where it is looked at step by step; `play` looks
    # once a frame.
    keys = [(0, "s", True), (150, "s", False), (151, "w", True)]
    names = with_edges(names)
    flight = flown(names, 400, keys, seed=4, asteroids=8)
    scenario = flight.saved()
    ends = [play(ENGINES[name].make(), name, scenario, flight.dt).trajectory for name in names]
    nearest = min(float(end.position[:, SHIP, 0].min()) for end in ends if end is not None)

    assert flight.left_at < 0
    assert -5.0 < nearest < -4.7
    for end, state in zip(ends, bits(flight)):
        assert end is not None
        assert {name: array.tobytes() for name, array in vars(end.at(-1)).items()} == state


def test_the_marker_names_the_first_collision():
    # pymunk as shipped has restitution 0.81 in a field of 0.9, so it diverges at the first
    # collision; the oracle names it.
    flight = flown(["reference:exercise", "pymunk:shipped", "pymunk:matched"], 64, [])
    scenario = flight.saved()
    ghost, matched = flight.flyers[1:]
    truth = read_truth(scenario)
    t, i, j = truth.collisions.t[0], truth.collisions.i[0], truth.collisions.j[0]

    assert ghost.divergence is not None
    assert set(ghost.divergence.at.disks) == {i, j}
    assert ghost.divergence.at.frame == int(t / FRAME)
    assert 0 <= ghost.divergence.at.t - t <= flight.dt
    assert ghost.divergence.only == ""
    assert matched.divergence is None or matched.divergence.at.frame > ghost.divergence.at.frame


def read_truth(scenario):  # type: ignore[no-untyped-def]
    from crosscheck2d.scenarios.truth.exact import with_oracle

    return with_oracle(scenario).truth(scenario.times)


class Failing:
    def __init__(self, row: EngineRow) -> None:
        self.inner, self.frames = row.make(), 0

    def __getattr__(self, name: str):  # type: ignore[no-untyped-def]
        return getattr(self.inner, name)

    def step(self, count: int = 1) -> None:
        self.frames += 1
        if self.frames == 3:
            raise RuntimeError("out of fuel")
        self.inner.step(count)


def test_an_engine_that_fails_leaves_and_the_others_fly_on(monkeypatch: pytest.MonkeyPatch):
    row = ENGINES["pymunk:matched"]
    monkeypatch.setitem(
        ENGINES, "pymunk:matched", EngineRow(lambda: Failing(row), "fails", 0.0, 0.0)
    )  # type: ignore[arg-type,return-value]
    flight = Flight(field_scenario(), ["pymunk:matched", "reference:exercise"])
    flight.advance(10)

    assert flight.flyers[0].left == "out of fuel"
    assert (flight.solid.name, flight.solid_since) == ("reference:exercise", 3 * FRAME)
    assert flight.frame == 10


class Meeting(OwnSolver):
    """A file that steps only while another does: side by side, or never. Its engine is the
    reference."""

    def __init__(self, barrier: Barrier, fails_at: int = 0) -> None:
        self.inner, self.barrier, self.frames = ENGINES["reference:exercise"].make(), barrier, 0
        self.fails_at = fails_at
        for verb in ("load", "apply_force", "read", "collisions", "close"):
            setattr(self, verb, getattr(self.inner, verb))

    def step(self, count: int = 1) -> None:
        self.barrier.wait()
        self.frames += 1
        if self.frames == self.fails_at:
            raise RuntimeError("out of fuel")
        self.inner.step(count)


def meeting(
    names: Sequence[str],
    monkeypatch: pytest.MonkeyPatch,
    fails_at: int = 0,
    patience: float = 10.0,
) -> Flight:
    barrier = Barrier(2, timeout=patience)
    for k, name in enumerate(names):
        make = partial(Meeting, barrier, 0 if k else fails_at)
        monkeypatch.setitem(ENGINES, name, EngineRow(make, "waits", 1.0, 0.0))
    return Flight(field_scenario(), [*names, "reference:exercise"])


def test_files_fly_side_by_side_each_with_its_own_state(monkeypatch: pytest.MonkeyPatch):
    flight = meeting(["a:own", "b:own"], monkeypatch)
    flight.key("w", True)
    flight.advance(20)
    names, states = [flyer.name for flyer in flight.flyers], bits(flight)
    touches = [flyer.touches.count for flyer in flight.flyers]
    lonely = meeting(["a:own"], monkeypatch, patience=0.1)
    lonely.advance(1)

    assert [flyer.left for flyer in flight.flyers] == [""] * 3
    assert names == ["a:own", "b:own", "reference:exercise"]
    assert states[0] == states[1] == states[2]
    assert touches[0] == touches[1] == touches[2]
    assert "BrokenBarrierError" in lonely.flyers[0].left


def test_a_file_that_raises_in_its_thread_leaves_and_the_others_fly_on(
    monkeypatch: pytest.MonkeyPatch,
):
    flight = meeting(["a:own", "b:own"], monkeypatch, fails_at=3)
    flight.advance(3)
    left, other, _ = flight.flyers

    assert (left.left, left.left_at) == ("out of fuel", 3 * FRAME)
    assert (other.left, flight.solid.name) == ("", "b:own")


def test_spin_is_part_of_the_energy():
    flight = Flight(field_scenario(), ["reference:exercise"])
    scene, reported = flight.scenario.scene, flight.measures(flight.solid)
    each = [
        m * (v @ v) / 2 + i * w * w / 2
        for m, v, i, w in zip(scene.mass, scene.velocity, scene.inertia, scene.angular_velocity)
    ]

    assert reported["energy"] == pytest.approx(sum(each), rel=1e-14)
    assert reported["momentum"] == pytest.approx((scene.mass @ scene.velocity).tolist(), rel=1e-13)
    assert 0 < pi / 4 * 0.3**4 * scene.angular_velocity[1] ** 2 < reported["energy"]


def test_an_engine_leaves_by_the_flights_clock(monkeypatch: pytest.MonkeyPatch):
    row = ENGINES["event_driven:float64"]
    monkeypatch.setitem(
        ENGINES, "event_driven:float64", replace(row, make=lambda: Accumulating(row))
    )
    names = ["reference:exercise", "event_driven:float64"]
    flight = flown(names, 240, [(0, "s", True)], asteroids=0)
    left = flight.flyers[1]
    frame = round(left.left_at / FRAME)

    assert len(left.edges) == 1
    assert 222 < frame < 240
    assert left.left == f"they accumulate at {left.touches.since + Accumulating.AT:.4g} s"
    assert left.left_at - FRAME <= left.touches.since + Accumulating.AT <= left.left_at + FRAME


class Accumulating(Failing):
    """An event engine that stops some time after it was loaded for the second time, and says when
    by its own clock."""

    AT = 0.125

    def load(self, scene: Scene, dt: float) -> None:
        self.loads = getattr(self, "loads", 0) + 1
        self.inner.load(scene, dt)

    def step(self, count: int = 1) -> None:
        self.inner.step(count)
        if self.loads == 2 and self.inner.steps * self.inner.dt >= self.AT:
            raise Unsupported("they accumulate at 0.125 s") from NoTruth("", self.AT)


def test_ghosts_are_compared_after_the_ship_was_set_back():
    names = ["reference:exercise", "pymunk:matched", "box2d:matched"]
    flight = flown(names, 300, [(0, "s", True), (260, "s", False)], asteroids=0)
    together = [(len(flyer.edges), flyer.divergence) for flyer in flight.flyers]
    struck = flight.flyers[1]
    state = put_ship(flight, struck, velocity=struck.state.velocity[SHIP] + 0.5)
    ahead = ContactImpulse(0, SHIP, -1, 1.0)  # of the next frame
    struck.touches.note([ahead], flight.frame, state, flight.frame * FRAME)
    flight.advance(20)

    assert together == [(1, None)] * 3
    assert struck.divergence is not None
    assert struck.divergence.at.frame == 300
    assert flight.flyers[2].divergence is None  # negative control: nothing struck that one


def test_a_ship_that_leaves_in_one_engine_only_diverges_at_the_edge():
    flight = flown(["reference:exercise", "pymunk:matched"], 200, [(0, "s", True)], asteroids=0)
    slow = flight.flyers[1]
    put_ship(flight, slow, position=slow.state.position[SHIP] + [0.3, 0.0])
    while flight.left_at < 0:
        flight.advance()
    soon = slow.divergence
    flight.advance(8)

    assert soon is None
    assert slow.divergence is not None
    assert (slow.divergence.at.disks, slow.divergence.at.frame) == ((), flight.left_at)
    assert slow.divergence.at.x == pytest.approx(-5.0, abs=0.01)
    assert slow.divergence.only == "reference:exercise"


def test_the_first_wrong_collision_is_named_though_the_pair_goes_on_colliding():
    # As a solver with a wrong sign has it, whose disks stay in each other, and one of which then
    # strikes another; the place is that of the collision, not where the disks were thrown to.
    scene = field_scenario().scene
    solid, ghost = Touches(scene, 1 / 1024, 0.0), Touches(scene, 1 / 1024, 0.0)
    before, thrown = scene.state, np.zeros((scene.n, 2))
    since, found = np.full(scene.n, NEVER), []
    for frame in range(10, 20):
        first = 16 * frame  # step
        again = [ContactImpulse(first + k, 3, 4, 1.0) for k in range(16)]
        solid.note([*again, ContactImpulse(first + 15, 4, 5, 1.0)], frame, before, first / 1024)
        ghost.note(again[:1] if frame == 10 else [], frame, before, first / 1024)
        thrown[[3, 4]] = 1e3 * frame
        thrown[5] = 1.0 if frame > 12 else 0.0
        since = differing_since(since, thrown, np.zeros_like(thrown), frame)
        found.append(cause_of(since, solid, ghost, before, frame))
    assert found[: WAIT - 1] == [None] * (WAIT - 1)
    at, in_solid, in_ghost = found[WAIT - 1]  # type: ignore[misc]

    assert (at.frame, at.disks) == (10, (3, 4))
    three, four = (before.position + before.velocity / 1024)[3:5]
    share = scene.radius[3] / scene.radius[3:5].sum()
    assert (at.x, at.y) == pytest.approx(tuple(three + share * (four - three)))
    assert (in_solid, in_ghost) == (True, True)


def test_a_velocity_that_differs_without_a_collision_is_said_to():
    names = ["reference:exercise", "pymunk:matched"]
    flight = flown(names, 40, [(0, "w", True), (20, "w", False)], asteroids=0)
    slow = flight.flyers[1]
    put_ship(flight, slow, velocity=slow.state.velocity[SHIP] / 2)
    flight.advance(WAIT)

    assert slow.divergence is not None
    assert slow.divergence.at == FlightEvent(40, *slow.state.position[SHIP], (SHIP,))


@pytest.mark.parametrize("name", ["reference:exercise", "event_driven:float64", "pymunk:matched"])
def test_a_ship_whose_start_is_taken_is_set_back_beside_it(name: str):
    scenario = field_scenario(asteroids=1)
    scene = replace(
        scenario.scene,
        position=np.array([START, [START[0], 0.9]]),
        velocity=np.array([[-8.0, 0.0], [0.0, -4.8]]),
    )
    flight = Flight(replace(scenario, scene=scene), [name])
    while flight.left_at < 0 and flight.frame < 20:
        flight.advance()
    flyer = flight.solid
    ship, rock = flyer.state.position

    assert (flyer.left, len(flyer.edges), flyer.beside) == ("", 1, True)
    assert np.hypot(*(ship - rock)) >= scene.radius.sum()
    assert np.hypot(*(ship - START)) < 2 * scene.radius.sum()


def test_a_ship_whose_start_is_free_goes_there():
    scene = field_scenario(asteroids=1).scene
    crowd = replace(scene, radius=np.array([scene.radius[0], 20.0]))

    assert free_place(scene, scene.position).tolist() == list(START)
    assert free_place(crowd, crowd.position).tolist() == list(START)


def test_collisions_are_counted_as_a_run_counts_them():
    flight = flown(["reference:exercise", "pymunk:matched", "event_driven:float64"], 380)
    every = [ContactImpulse(k, 1, 2, 1e-3) for k in range(100)]
    counted = Touches(flight.scenario.scene, flight.dt, 2e-3)
    for one in every:
        counted.note([one], 0, flight.solid.state, 0.0)

    for flyer in flight.flyers:
        whole = first_collisions(flyer.engine.collisions(), flight.dt)
        assert flyer.touches.count == len(whole) > 5
    assert counted.count == len(first_collisions(every, flight.dt, 2e-3)) == 1
