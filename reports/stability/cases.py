"""All cases by name, and the headings they stand under, in reading order. Here are those of whole
scenes: the largest usable dt of every scenario of the suite, and one quantity of a user's scene
file that is varied."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.collisions import match, on_faces, pair_keys, thrown_off, who
from crosscheck2d.reports.compare.verdicts import MOST_LOST, MOST_OVERLAP, Verdict, verdicts
from crosscheck2d.reports.compare.view import cut
from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.stability import (
    cases_few,
    cases_many,
    predicates,
    predicates_gas,
)
from crosscheck2d.reports.stability.cases_many import restarted, reversed_order
from crosscheck2d.reports.stability.limits import (
    WITH_FRICTION_ONLY,
    Case,
    once,
    step_size,
    with_variant,
)
from crosscheck2d.reports.stability.predicates import largest, predicate, read, worst_of
from crosscheck2d.scenarios.catalogue import RANDOM, SCENARIOS, scenario
from crosscheck2d.scenarios.files.scene_file import read_scene_file
from crosscheck2d.scenarios.model import (
    Array,
    Scenario,
    Scene,
    Thrust,
    Trajectory,
    frozen,
)
from crosscheck2d.scenarios.no_truth import answered
from crosscheck2d.scenarios.truth.exact import with_oracle

GHOST = "ghost collision"
LEAST_WAY = 0.01  # radii between two samples; smaller distances are rounding
STEADY = 1e-9  # of a velocity; a smaller change between two samples is the rounding of the answer
MOST_SAMPLES = 300  # samples at most
LONG = 2e4  # steps of a disk
SEEDS = 4  # runs at a value of a random scene


@predicate(
    "a number is not finite, a disk goes through a wall or a disk, energy grows by 5 %, disks"
    " overlap by a tenth of a radius, a disk in free flight moves by half its distance only (its"
    " speed is capped, or its position has too few digits), or a collision is wrong",
    "of the bound",
    1.0,
)
def unusable(scenario: Scenario, played: Trajectory) -> Verdict:
    scene, dt = scenario.scene, step_size(scenario)
    _, true = answered(scenario)
    # for a single free disk nothing is checked
    parts = [read(0.0, np.nan, "")]
    if scene.n + len(scene.walls) > 1:
        # in any sample: a verdict allows for the approach in a step, but here that is too large
        overlap = laws.penetration(played, scene)
        event = f"an overlap of {overlap.max():.3g} radii"
        parts.append(largest(played.t, overlap, MOST_OVERLAP, event, None, "penetration"))
    if len(played) > 1 and scene.wrap is None:
        parts.append(slowed(scenario, played, true))
    if true is not None:
        k = min(len(played), len(true))
        parts += wrong_collisions(scene, cut(played, k), cut(true, k), dt)
        value, at, disk, wall = thrown_off(played, true, scene)
        event = f"disk {disk} is thrown off the surface of wall {wall}, where two of its walls meet"
        parts.append(read(value, at, event, disk, GHOST))
    for verdict in verdicts(scenario, played, dt):
        if verdict.id in ("tunnelled", "energy_gained"):
            value = verdict.value / verdict.bound if verdict.bound else 2 * verdict.value
            first = verdict.disks[0] if verdict.disks else None
            parts.append(read(value, verdict.at, verdict.text, first, verdict.id))
    return worst_of(parts[1:] or parts)


def slowed(scenario: Scenario, played: Trajectory, true: Trajectory | None) -> Verdict:
    """The largest part of its distance that a disk loses in a sample interval of free flight: its
    position has too few digits, or the engine caps its speed.

    The distance is that of the engine's own velocity, before the first collision of a disk: two
    collisions between two samples may restore its velocity. It is also that of the exact answer, as
    long as the disk has met nothing but walls, as often as there: its speed must be the same.
    """
    scene, v = scenario.scene, played.velocity
    met = collided(played, scene, played.t)
    steady = (v[1:] == v[:-1]).all(axis=2) & ~met[1:].any(axis=2) & ~scene.static
    expected = np.where(steady, laws.lengths(v[1:]) * scenario.sample_interval, 0.0)
    if true is not None and len(true) > 1:
        met, exact = (collided(run, scene, true.t) for run in (played, true))
        alike = (met == exact).all(axis=2) & (exact[:, :, 0] == 0)
        free = (np.diff(exact, axis=0) == 0).all(axis=2)
        v = true.velocity
        steady = laws.lengths(np.diff(v, axis=0)) <= STEADY * laws.lengths(v[1:])
        where = alike[1:] & alike[:-1] & free & steady
        distance = np.where(where, laws.lengths(np.diff(true.position, axis=0)), 0.0)
        expected[: len(distance)] = np.maximum(expected[: len(distance)], distance)
    expected /= scene.radius
    moved = laws.lengths(np.diff(played.position, axis=0)) / scene.radius
    lost = np.where(expected > LEAST_WAY, 1 - moved / np.where(expected > 0, expected, 1.0), 0.0)
    k, disk = np.unravel_index(int(lost.argmax()), lost.shape)
    event = f"disk {disk} moves by {max(1 - float(lost[k, disk]), 0.0):.3g} of its distance"
    return read(lost.max() / MOST_LOST, played.t[k + 1], event, int(disk), "wrong distance")


def collided(played: Trajectory, scene: Scene, t: Array) -> Array:
    """(times, n, 1 + walls): how often each disk has met other disks, and each wall, up to and
    including the times `t` (s)."""
    counts = np.zeros((len(t) + 1, scene.n, 1 + len(scene.walls)))
    hits = on_faces(played, scene)
    when = np.searchsorted(t, hits.t)
    for disk, other in ((hits.i, hits.j), (hits.j, hits.i)):
        of_disk = disk >= 0
        np.add.at(counts, (when[of_disk], disk[of_disk], np.maximum(-other[of_disk], 0)), 1)
    return counts.cumsum(axis=0)[:-1]


def wrong_collisions(
    scene: Scene, played: Trajectory, true: Trajectory, dt: float
) -> Iterator[Verdict]:
    actual, exact = (on_faces(run, scene) for run in (played, true))
    end = float(true.t[-1])
    matched = match(actual, exact, end, dt)
    wrong = matched.first_wrong
    if wrong is None:
        # `match` leaves out a collision near the start: it is missed if its pair never collides
        hard = (exact.impulse > 0) & (exact.t < end - 3 * dt)
        missed = np.flatnonzero(hard & ~np.isin(pair_keys(exact), pair_keys(actual)))
        if not len(missed):
            return
        first = missed[0]
        wrong = float(exact.t[first]), f"missed {who(exact.i[first], exact.j[first])}"
    at, what = wrong
    kind, pair = what.split(maxsplit=1)
    count = len(matched.missed) + len(matched.spurious)
    disk = int(pair.split("-")[0])
    yield read(2.0 * max(count, 1), at, f"{kind} collision: {pair}", disk, "collisions")


def in_steps(whole: Scenario, dt: float) -> Scenario:
    """The scenario with a step as near to `dt` s as its duration allows, sampled at most
    `MOST_SAMPLES` times."""
    steps = max(1, round(whole.duration / dt))
    every = -(-steps // MOST_SAMPLES)
    samples = -(-steps // every)
    return replace(whole, sample_interval=whole.duration / samples, substeps=(every,))


def ladder(whole: Scenario, an_octave: int = 1) -> tuple[float, ...]:
    """Step sizes in s, a fixed number for each factor of two, from an eighth of the sample
    interval to a tenth of the duration."""
    steps = [whole.sample_interval * 2.0 ** (k / an_octave - 3) for k in range(23 * an_octave)]
    return tuple(dt for dt in steps if dt <= whole.duration / 10)


def dense_ladder(whole: Scenario) -> tuple[float, ...]:
    """As `ladder`, and from the sample interval on four for each factor of two (two where a run is
    long).

    In a scene without random numbers each dt puts the collisions at other places within their
    steps: failures appear at scattered step sizes, and only a dense scan finds the first. Finer
    steps seldom fail and cost most. Both forms scan the same step sizes.
    """
    steps = whole.duration / whole.sample_interval * 8
    close = ladder(whole, 2 if whole.scene.n * steps > LONG else 4)
    return tuple(sorted({*ladder(whole), *(dt for dt in close if dt > whole.sample_interval)}))


def suite_case(name: str, whole: Scenario) -> Case:
    return Case(
        f"dt_{name}",
        whole.asks,
        lambda x, run: in_steps(scenario(name, run), x),
        "dt",
        dense_ladder(whole),
        unusable,
        unit="s",
        runs=SEEDS if name in RANDOM else 1,
        ratio=1.2,
        refines=False,
    )


def with_scene(whole: Scenario, **fields: Any) -> Scenario:
    return with_oracle(replace(whole, scene=replace(whole.scene, **fields)))


def at_mass_ratio(whole: Scenario, x: float) -> Scenario:
    scene, disk = whole.scene, heaviest(whole.scene)
    factor = np.where(np.arange(scene.n) == disk, x, 1.0)
    thrusts = [scaled_thrust(t, x, x) if t.disk == disk else t for t in whole.thrusts]
    heavier = replace(whole, thrusts=thrusts)
    return with_scene(heavier, mass=scene.mass * factor, inertia=scene.inertia * factor)


def heaviest(scene: Scene) -> int:
    """The heaviest disk that moves; of several the smallest, then the first by x and y, so that the
    order of the disks does not matter."""
    keys = (*scene.position.T[::-1], scene.radius, -scene.mass, scene.static)
    return int(np.lexsort(keys)[0])


def similar(whole: Scenario, size: float = 1.0, shift: float = 0.0) -> Scenario:
    """The same motion, `size` times as large, and moved by `shift` m to the right.

    The exact answer is computed from that of the scene itself. It is exact except for the last
    digit of the scene's numbers; the oracle does not accept scenes whose scale is far from 1.
    """
    scene, truth, by = whole.scene, whole.truth, np.array([shift, 0.0])
    changed: Scene = replace(
        scene,
        position=scene.position * size + by,
        velocity=scene.velocity * size,
        radius=scene.radius * size,
        inertia=scene.inertia * size**2,
        walls=scene.walls * size + by,
        gravity=scene.gravity * size,
        wrap=None if scene.wrap is None else scene.wrap * size + by,
    )

    def answer(t: Array) -> Trajectory:
        assert truth is not None
        was = truth(t)
        return replace(
            was,
            position=was.position * size + by,
            velocity=was.velocity * size,
            error_bound=was.error_bound * size,
            collisions=replace(was.collisions, impulse=frozen(was.collisions.impulse * size)),
        )

    thrusts = [scaled_thrust(t, size, size**2) for t in whole.thrusts]
    return replace(whole, scene=changed, thrusts=thrusts, truth=None if truth is None else answer)


def scaled_thrust(thrust: Thrust, force: float, torque: float) -> Thrust:
    return replace(thrust, force=thrust.force * force, torque=thrust.torque * torque)


# what `--vary` takes
VARIES: dict[str, Callable[[Scenario, float], Scenario]] = {
    "dt": in_steps,
    "speed": lambda whole, x: with_scene(
        whole,
        velocity=whole.scene.velocity * x,
        angular_velocity=whole.scene.angular_velocity * x,
    ),
    "mass_ratio": at_mass_ratio,
    "restitution": lambda whole, x: with_scene(whole, restitution=x),
    "scale": lambda whole, x: similar(whole, size=x),
    "offset": lambda whole, x: similar(whole, shift=x),
}


def cannot_vary(whole: Scenario, what: str) -> str | None:
    """Why this cannot be varied in a scene, as the end of a sentence; None if it can."""
    if what == "mass_ratio" and whole.scene.static.all():
        return "no disk moves, so that none can be made heavier"
    if what == "dt" and not ladder(whole):
        return (
            "it lasts less than ten steps of an eighth of its sample_interval, the finest that"
            " would be tried"
        )
    return None


SCENES = cases_few.SCENES | cases_few.SCENES_WITH_FRICTION | cases_many.SCENES
PREDICATES = {
    row.name: row
    for row in (
        predicates.collisions_missed,
        predicates.spurious_collisions,
        predicates.restitution_off,
        predicates.wrong_distance,
        predicates.velocity_off,
        predicates.deviation,
        predicates.angle_off,
        predicates.spring_grows,
        predicates.bounce_off,
        predicates.friction_off,
        predicates.rolling_off,
        predicates.slips,
        predicates.creeps,
        predicates.does_not_stand,
        predicates.ejected,
        predicates.still_overlap,
        predicates.bursts,
        predicates.not_at_rest,
        predicates_gas.energy_drifts,
        predicates_gas.momentum_drifts,
        predicates_gas.diverges,
        predicates_gas.temperatures_part,
        predicates_gas.wrong_gas,
    )
}
PLAYS = {play.__name__: play for play in (cases_few.on_spring, reversed_order, restarted)}


def read_case(name: str, row: dict[str, Any]) -> Case:
    """The case of a row of cases.toml."""
    row = dict(row)
    also = WITH_FRICTION_ONLY if name in cases_few.SCENES_WITH_FRICTION else ()
    for variant in row.pop("variants", ()):
        also += with_variant(variant)
    row |= {key: tuple(row[key]) for key in ("values", "quick_values") if key in row}
    play, predicate = PLAYS.get(row.pop("play", ""), once), PREDICATES[row.pop("fails")]
    return Case(name=name, scene=SCENES[name], predicate=predicate, play=play, also=also, **row)


TEXT = tomllib.loads(Path(__file__).with_name("cases.toml").read_text(encoding="utf-8"))
OWN_SCENE = "A scene of your own"
OF_OWN_SCENE = TEXT.pop(OWN_SCENE)  # parameter, unit and values of each of `VARIES`
OF_MAPS = TEXT.pop("maps")
FAMILIES = {
    family: [read_case(name, row) for name, row in rows.items()] for family, rows in TEXT.items()
} | {
    "The largest dt of the suite's scenes": [
        suite_case(name, whole)
        for name, whole in SCENARIOS.items()
        if not whole.scene.friction  # the kept limits are of the scenes without
    ]
}
CASES: dict[str, Case] = {case.name: case for cases in FAMILIES.values() for case in cases}
FAMILY_OF = {case.name: family for family, cases in FAMILIES.items() for case in cases}


@cache
def case_named(name: str) -> Case:
    """A case of the table, or of a scene file, FILE.toml:vary: up to which value is it usable?"""
    if name in CASES:
        return CASES[name]
    path, what = name.rsplit(":", 1)
    whole, (parameter, unit, values) = read_scene_file(Path(path)), OF_OWN_SCENE[what]
    if what == "mass_ratio":
        parameter = parameter.replace("the heaviest disk", f"disk {heaviest(whole.scene)}")
    if what != "dt":
        parameter += f", at dt = {number(whole.dt(whole.middle_substeps))} s"

    def scene(x: float, run: int) -> Scenario:
        # at the middle step of its ladder; in run 1 the other way: divided by x
        changed = VARIES[what](whole, 1 / x if run else x)
        return changed if what == "dt" else replace(changed, substeps=(whole.middle_substeps,))

    return Case(
        name,
        f"{whole.name}: {whole.asks}",
        scene,
        parameter,
        tuple(values) or dense_ladder(whole),
        unusable,
        unit,
        runs=2 if what == "mass_ratio" else 1,
        also=WITH_FRICTION_ONLY if whole.scene.friction else (),
    )
