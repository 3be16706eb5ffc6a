"""The probes of the protocol: an adapter that fails one of them is broken, and so is every number
from it.

A solver's own file is played by an adapter of ours. So it breaks the protocol only by what the
adapter cannot keep from it, such as state from one call to the next. One that raises or gives
numbers that are none is a faulty solver.
"""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace

import numpy as np

from crosscheck2d.adapters.conformance.probe import (
    DT,
    ROUNDINGS,
    Departure,
    ProbeReading,
    Questions,
    act_on,
    before_and_after,
    first_difference,
    head_on,
    history,
    is_silent,
    largest,
    load_first,
    loaded,
    must_report,
    one_disk,
    plain,
    probes,
    reported,
    scene_of,
    simplified,
)
from crosscheck2d.adapters.engine import Unsupported
from crosscheck2d.adapters.engine_row import FLOAT32, EngineRow
from crosscheck2d.adapters.run import fault_of


def order_and_shapes(row: EngineRow) -> ProbeReading:
    """Three disks of which the middle one is static; float32 rounds by 2^-24, twice if units are
    scaled."""
    scene = scene_of(
        [[1.0, 2.0], [-3.0, 0.5], [0.1, -4.0]],
        [[0.3, -0.7], [0.0, 0.0], [1.1, 0.2]],
        angle=[0.2, -1.0, 7.0],
        angular_velocity=[0.9, 0.0, -1.3],
        radius=[0.5, 1.0, 0.25],
        mass=[1.0, np.inf, 5.0],
    )
    faults = []
    rounding = FLOAT32 if row.source else row.rounding  # a file may calculate in either
    with closing(row.make()) as engine:
        played = load_first(engine, simplified(scene), DT)
        state = engine.read()
    for name, wanted in vars(played.state).items():
        array = getattr(state, name)
        if array.dtype != np.float64 or array.shape != wanted.shape:
            faults.append(f"{name} is {array.dtype} {array.shape}")
        elif (off := np.abs(array - wanted)).max() > 4 * rounding * largest(wanted):
            faults.append(
                f"{name} of disk {int(np.argwhere(off == off.max())[0][0])} is off by"
                f" {off.max():.3g}"
            )
    words = "; ".join(faults) or "as the scene"
    return ProbeReading(words, "as the scene", departure=Departure.START)


def read_copies(row: EngineRow) -> ProbeReading:
    faults = set()
    with loaded(row, *simplified(plain())) as engine:
        early = engine.read()
        before = {name: array.copy() for name, array in vars(early).items()}
        engine.step(5)
        late = engine.read()
        for name, array in vars(late).items():
            if not np.array_equal(getattr(early, name), before[name], equal_nan=True):
                faults.add(f"{name} changed by a step")
            kept = array.copy()
            if array.flags.writeable:
                array.fill(99.0)
            if not np.array_equal(getattr(engine.read(), name), kept, equal_nan=True):
                faults.add(f"{name} changed by writing")
    return ProbeReading("; ".join(sorted(faults)) or "copies", "copies")


def load_forgets(row: EngineRow) -> ProbeReading:
    scenes = simplified(plain())
    with loaded(row, *simplified(replace(head_on(2.0), restitution=1.0))) as used:
        last = len(used.read().angle) - 1
        for _ in range(12):
            act_on(used, last, (1.0, 2.0), 3.0)
            used.step()
        act_on(used, last // 2, (5.0, 5.0), 5.0)
        try:
            load_first(used, scenes, DT / 2)
            left = len(used.collisions())
            seen = history(used)
        except Unsupported:
            raise
        except Exception as raised:  # only after a scene, if a fresh engine does not raise
            left, seen = 0, [(f"it fails: {raised}", b"")]
    with loaded(row, *scenes, dt=DT / 2) as fresh:
        wanted = history(fresh)
    difference = "collisions at the start" if left else first_difference(seen, wanted)
    return ProbeReading(difference, "nowhere", departure=Departure.MEMORY)


def worlds_are_separate(row: EngineRow) -> ProbeReading:
    # A second engine of the same kind, a hundred times as large, changes nothing in the first.
    large = scene_of([[0.0, 0.0]], [1.0, 0.0], radius=50.0)
    scenes = simplified(plain())
    with loaded(row, *scenes) as alone:
        wanted = history(alone)
    with loaded(row, *scenes) as one, loaded(row, large) as other:
        other.step(5)
        seen = history(one)
    return ProbeReading(first_difference(seen, wanted), "nowhere")


def counts_are_steps(row: EngineRow) -> ProbeReading:
    scenes = simplified(plain())
    with loaded(row, *scenes) as one_by_one:
        for _ in range(60):
            one_by_one.step()
        wanted = history(one_by_one)
    with loaded(row, *scenes) as at_once:
        for _ in range(20):
            at_once.step(3)
        seen = history(at_once)
    return ProbeReading(first_difference(seen, wanted), "nowhere")


def steps_obey_dt(row: EngineRow) -> ProbeReading:
    # v dt a step, for two dt; a position rounds once a step.
    worst, steps, speed = 0.0, 64, 1.5
    for dt in (DT, 0.01):
        before, after = before_and_after(row, one_disk((speed, 0.0)), steps=steps, dt=dt)
        way = (after.position - before.position)[0, 0]
        worst = max(worst, abs(way / (steps * dt) - speed))
    return ProbeReading(speed + worst, speed, row.rounding * steps * speed)


def stays_finite(row: EngineRow) -> ProbeReading:
    with loaded(row, *simplified(plain())) as engine:
        for k in range(20):
            engine.step()
            if fault := fault_of(engine.read(), np.inf):
                return ProbeReading(f"{fault} after step {k + 1}", "finite")
    return ProbeReading("finite", "finite")


def force_lasts_one_step(row: EngineRow) -> ProbeReading:
    # One force, then one step, then three: the speed is the same after the first step and after
    # all.
    force, torque = (20.0, 10.0), 3.0
    with loaded(row, one_disk()) as engine:
        turns = act_on(engine, 0, force, torque)  # it may model forces without rotation
        engine.step()
        first = engine.read()
        engine.step(3)
        last = engine.read()
    with loaded(row, one_disk()) as engine:
        engine.apply_force(0, np.array(force), torque if turns else 0.0)
        engine.step(4)
        at_once = engine.read()
    ratios = [
        largest(getattr(later, rate)) / once if (once := largest(getattr(first, rate))) else np.inf
        for rate in ("velocity", "angular_velocity")[: 1 + turns]
        for later in (last, at_once)
    ]
    # Nothing acts on the disk afterwards, so its velocity is not even rounded again.
    return ProbeReading(max(ratios, key=lambda ratio: abs(ratio - 1)), 1.0, 4 * row.rounding)


def inertia_seen(row: EngineRow, force: float, torque: float) -> float:
    with loaded(row, one_disk()) as engine:
        engine.apply_force(0, np.array([force, 0.0]), torque)
        engine.step()
        state = engine.read()
    change = float(state.angular_velocity[0] if torque else state.velocity[0, 0])
    return (force or torque) * DT / change if change else np.inf


def mass_by_force(row: EngineRow) -> ProbeReading:
    # F dt / dv; a density of 1 would give the disk 0.785 kg.
    return ProbeReading(inertia_seen(row, 30.0, 0.0), 7.3, ROUNDINGS * row.rounding * 7.3)


def inertia_by_torque(row: EngineRow) -> ProbeReading:
    # torque dt / dw; a solid disk of that mass would have 0.9125 kg m2.
    return ProbeReading(inertia_seen(row, 0.0, 2.0), 0.9, ROUNDINGS * row.rounding * 0.9)


def same_instant(row: EngineRow) -> ProbeReading:
    # After 1 s of free fall the speed is g t; a velocity half a step off would differ by g dt / 2 =
    # 0.02 m/s.
    steps, gravity = 256, 9.81
    _, state = before_and_after(row, one_disk(gravity=gravity), steps=steps)
    speed = -float(state.velocity[0, 1])
    return ProbeReading(speed, gravity * steps * DT, row.rounding * steps * gravity)


def collisions_are_reported(row: EngineRow) -> ProbeReading:
    with loaded(row, head_on(2.0)) as engine:
        engine.step(12)
        return ProbeReading(reported(engine), "disk 1 and disk 2")


def walls_are_reported(row: EngineRow) -> ProbeReading:
    walls = [[[-0.53, -2.0], [-0.53, 2.0]], [[0.53, -2.0], [0.53, 2.0]]]
    scene = scene_of([[0.0, 9.0], [0.0, 0.0]], [[0.0, 0.0], [2.0, 0.0]], walls=walls)
    with loaded(row, scene) as engine:
        engine.step(12)
        return ProbeReading(reported(engine), "disk 1 and wall 1")


def collisions_name_their_step(row: EngineRow) -> ProbeReading:
    with loaded(row, head_on(2.0)) as engine:
        must_report(engine)
        before = engine.read().velocity[1, 0]
        changed = 0
        while changed < 12 and abs(engine.read().velocity[1, 0] / before - 1) < 0.1:
            engine.step()
            changed += 1
        steps = [collision.step for collision in engine.collisions()]
    return ProbeReading(steps[0] if steps else np.nan, changed - 1)


def impulse_is_reported(row: EngineRow) -> ProbeReading:
    # The reported impulses add up to the momentum exchanged; an engine may also report none (NaN).
    with loaded(row, head_on(2.0)) as engine:
        must_report(engine)
        before = engine.read().velocity[2, 0]
        engine.step(12)
        moved = engine.read().velocity[2, 0] - before
        impulses = [collision.impulse for collision in engine.collisions()]
    if np.isnan(impulses).any():
        return ProbeReading(
            "not reported", "not reported", note="the engine's events carry no impulse"
        )
    return ProbeReading(float(sum(impulses)), float(moved), ROUNDINGS * row.rounding * abs(moved))


def static_stays(row: EngineRow) -> ProbeReading:
    # A static disk keeps its state to the bit under a collision and a force. The collision is asked
    # for if the engine reports any.
    scene = scene_of(
        [[-1.02, 0.1], [0.0, 0.0]],
        [[2.0, 0.0], [0.0, 0.0]],
        mass=[1.0, np.inf],
        gravity=[0.0, -9.8],
    )
    with loaded(row, scene) as engine:
        before = engine.read()
        for _ in range(12):
            act_on(engine, 1, (5.0, 5.0), 5.0)
            engine.step()
        after, stays = engine.read(), "stays"
        if not is_silent(engine):
            stays = f"stays, reported {reported(engine)}"
    moved = [
        name for name, array in vars(after).items() if (array[1] != getattr(before, name)[1]).any()
    ]
    return ProbeReading(
        "; ".join(f"{name} changed" for name in moved) or stays,
        "stays" if stays == "stays" else "stays, reported disk 0 and disk 1",
        departure=Departure.STATIC if moved else None,
    )


OF_ADAPTER: Questions = {
    order_and_shapes: "Does read give float64 arrays in the scene's order?",
    read_copies: "Does read give copies?",
    load_forgets: "Where does a used engine differ from a fresh one after load?",
    worlds_are_separate: "Where does a second engine disturb the first?",
    counts_are_steps: "Where does step(3) differ from three steps?",
}
HANDED_ON: Questions = {
    steps_obey_dt: "How fast is a disk of 1.5 m/s by its path, at two dt? (m/s)",
    stays_finite: "Is every number finite for 20 steps of a plain scene?",
    force_lasts_one_step: (
        "How much faster is a disk 3 steps after a force than after its first step?"
    ),
    mass_by_force: "What mass does a force see? (kg)",
    inertia_by_torque: "What inertia does a torque see? (kg m2)",
    same_instant: "How fast is a disk after 1 s under 9.81 m/s2? (m/s)",
    collisions_are_reported: "Which collisions are reported when disks 1 and 2 meet once?",
    walls_are_reported: "Which collisions are reported when disk 1 meets wall 1 once?",
    collisions_name_their_step: "In which step is a collision reported?",
    impulse_is_reported: "Which impulse is reported for a collision? (N s)",
    static_stays: "Does a static disk that is struck and under a force stay?",
}
CONTRACT = probes(OF_ADAPTER, "breaks") | probes(HANDED_ON, "breaks", handed_on=True)
