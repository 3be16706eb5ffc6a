"""Numbers of the table from the trajectories alone, each as its line in `crosscheck list metrics`
says.

Left out: what is judged in collision-free samples (velocity, energy error and loss, deviation of
momentum and energy), the collisions that are matched to those of another (missed, spurious, delay),
and tunnelling. To add one, write it from its line and give it a row in `OWN`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.reports.compare.comparison import compare
from crosscheck2d.scenarios import catalogue
from crosscheck2d.scenarios.model import Scenario, Trajectory

pytestmark = pytest.mark.independent

Record = Callable[[str, object], None]

SCENES = (
    "free_fall",
    "ping_pong",
    "head_on_equal_e1",
    "head_on_unequal_e05",
    "oblique_e09",
    "mass_ratios",
    "slow_collision",
    "wall_to_wall",
    "bouncing_ball_e09",
    "disk_between_static_disks",
    "column_of_ten",
    "galperin_31",
    "cradle_touching",
    "spin_under_torque",
    "ship_thrust",
    "asteroids",
    "falling_box",
)
PLAYED = (
    "reference:exercise",
    "pymunk:matched",
    "box2d:shipped",
    "box2d_v3:matched",
    "event_driven:float64",
)
ROUNDING = 1e-12  # relative: sums of thousands of terms in another order
# of energies and momenta over their whole: what is left of them is a difference, rounded at the
# whole
FLOAT64 = 1e-13
WITH = {
    "time_to_1pct_s": "bouncing_ball_e09",
    "restitution": "head_on_unequal_e05",
    "apex_change": "bouncing_ball_e09",
}


def norm(a: np.ndarray) -> np.ndarray:
    return np.sqrt((a**2).sum(axis=-1))


def distance(one: Trajectory, other: Trajectory, scenario: Scenario) -> np.ndarray:
    """(k, n) m; in the wrapping box the shorter way, across its edge where that is shorter."""
    away = one.position - other.position
    if scenario.scene.wrap is not None:
        size = scenario.scene.wrap[1] - scenario.scene.wrap[0]
        away = away - size * np.round(away / size)
    return norm(away)


def radii(one: Trajectory, other: Trajectory, scenario: Scenario) -> np.ndarray:
    return distance(one, other, scenario) / scenario.scene.radius


def turn(one: Trajectory, other: Trajectory, _: Scenario) -> np.ndarray:
    return np.abs(one.angle - other.angle)


def largest(of: Callable[..., np.ndarray]) -> Callable[..., float]:
    return lambda *given: float(of(*given).max())


def root_mean_square(of: Callable[..., np.ndarray]) -> Callable[..., float]:
    def mean(one: Trajectory, other: Trajectory, scenario: Scenario) -> float:
        off = of(one, other, scenario)
        squares = [
            off[:, i] ** 2 for i in range(scenario.scene.n) if scenario.scene.mass[i] < np.inf
        ]
        return float(np.sqrt(np.mean(squares)))

    return mean


def time_to_1pct(one: Trajectory, other: Trajectory, scenario: Scenario) -> float:
    off = (radii(one, other, scenario) > 0.01).any(axis=1)
    return float(one.t[off.argmax()]) if off.any() else np.inf


def moving(scenario: Scenario) -> np.ndarray:
    """(n,) kg, 0 for what cannot move: it carries neither momentum nor energy."""
    return np.where(scenario.scene.static, 0.0, scenario.scene.mass)


def alone(scenario: Scenario) -> bool:
    return not len(scenario.scene.walls) and not scenario.scene.static.any()


def on_for(scenario: Scenario, t: np.ndarray) -> list[np.ndarray]:
    return [np.clip(t, thrust.start, thrust.stop) - thrust.start for thrust in scenario.thrusts]


def momentum_error(one: Trajectory, _: None, scenario: Scenario) -> float | None:
    """From P(t) - P(0) - M g t - sum of F times how long it has acted.

    Over the sum of m|v|, each disk at its fastest without gravity and collisions; if nothing moves
    so, over M g T.
    """
    if not alone(scenario) or any(thrust.frame == "body" for thrust in scenario.thrusts):
        return None
    mass = moving(scenario)[:, None]
    outside = mass.sum() * scenario.scene.gravity * one.t[:, None]
    for thrust, on in zip(scenario.thrusts, on_for(scenario, one.t)):
        outside = outside + thrust.force * on[:, None]
    momentum = (mass * one.velocity).sum(axis=1)
    # between two changes of the thrusts a velocity moves on a line: it is longest at an end of one
    edges = [at for thrust in scenario.thrusts for at in (thrust.start, thrust.stop)]
    ends = sorted({0.0, *(min(at, scenario.duration) for at in edges)})
    scale = 0.0
    for disk, weight in enumerate(mass[:, 0]):
        speeds = []
        for end in np.array(ends)[:, None]:
            pushed = sum(
                thrust.force * on[0] / weight
                for thrust, on in zip(scenario.thrusts, on_for(scenario, end))
                if thrust.disk == disk
            )
            speeds.append(norm(scenario.scene.velocity[disk] + pushed))
        scale += weight * max(speeds)
    scale = scale or float(mass.sum() * norm(scenario.scene.gravity) * scenario.duration)
    return float(norm(momentum - momentum[0] - outside).max() / scale)


def angular_momentum_error(one: Trajectory, _: None, scenario: Scenario) -> float | None:
    """Of x cross m v + I w about the centre of mass of the scene, where nothing from outside turns
    it.

    Over the sum of m(|x| + r)|v| + I|w| at the start: a collision at a disk's edge has that lever.
    """
    turned = scenario.scene.gravity.any() or scenario.thrusts or scenario.scene.wrap is not None
    if turned or not alone(scenario):
        return None
    mass, inertia = moving(scenario), scenario.scene.inertia
    centre = (mass[:, None] * scenario.scene.position).sum(axis=0) / mass.sum()
    x, v, w = one.position - centre, one.velocity, one.angular_velocity
    momentum = (mass * (x[..., 0] * v[..., 1] - x[..., 1] * v[..., 0]) + inertia * w).sum(axis=1)
    start = scenario.scene
    scale = (mass * norm(start.velocity) * (norm(start.position - centre) + start.radius)).sum()
    scale += (inertia * np.abs(start.angular_velocity)).sum()
    return float(np.abs(momentum - momentum[0]).max() / scale)


def energy_created(one: Trajectory, _: None, scenario: Scenario) -> float | None:
    """From kinetic energy, without gravity and thrust: so the energy at hand is that of the
    start."""
    if scenario.scene.gravity.any() or scenario.thrusts:
        return None
    mass = moving(scenario)
    inertia = np.where(scenario.scene.static, 0.0, scenario.scene.inertia)
    energy = (mass * norm(one.velocity) ** 2 + inertia * one.angular_velocity**2).sum(axis=1) / 2
    return float((energy - np.minimum.accumulate(energy)).max() / energy[0])


def penetration(one: Trajectory, _: None, scenario: Scenario) -> float:
    scene, deepest = scenario.scene, 0.0
    for i in range(scene.n):
        for j in range(i + 1, scene.n):
            reach = scene.radius[i] + scene.radius[j]
            overlap = reach - norm(one.position[:, i] - one.position[:, j]).min()
            deepest = max(deepest, overlap / min(scene.radius[i], scene.radius[j]))
        for start, end in scene.walls:
            along = end - start
            share = np.clip((one.position[:, i] - start) @ along / (along @ along), 0, 1)
            nearest = norm(one.position[:, i] - start - share[:, None] * along).min()
            deepest = max(deepest, (scene.radius[i] - nearest) / scene.radius[i])
    return float(deepest)


def restitution(one: Trajectory, _: None, scenario: Scenario) -> float | None:
    """From the samples beside it, where two disks on a line along x meet once and nothing else
    happens; or of a ball that bounces on a level floor."""
    if one.position[..., 1].any() or scenario.scene.gravity.any() or scenario.scene.n != 2:
        return bounces(one, scenario) if scenario.name.startswith("bouncing_ball") else None
    if one.collisions.j.tolist() != [1]:
        return None
    after = int(np.argmin(one.t < one.collisions.t[0] - 1e-9))
    v = one.velocity[[after - 1, after], :, 0]
    return float(-(v[1, 0] - v[1, 1]) / (v[0, 0] - v[0, 1]))


def bounces(one: Trajectory, scenario: Scenario) -> float | None:
    """The median of the bounces that are alone in two intervals of the samples, and ten
    times 1 + e intervals of falling fast.

    The fall and the rise are followed from the samples to the instant within the step that brings
    e nearest to what the scene states.
    """
    g, found = -scenario.scene.gravity[1], []
    step = scenario.dt(scenario.substeps[1])  # as in `compared`
    least = (1 + scenario.scene.restitution) * (401**0.5 / 2) * g * scenario.sample_interval
    for end in one.collisions.t:
        after = int(np.argmin(one.t < end - 1e-9))
        if after == 0 or after + 1 == len(one):
            continue
        near = one.collisions.t[(one.collisions.t > one.t[after - 1] + 1e-9)]
        if (near <= one.t[after + 1] + 1e-9).sum() > 1:
            continue
        down, up = -one.velocity[after - 1, 0, 1], one.velocity[after, 0, 1]
        if down + g * (end - one.t[after - 1]) <= least:
            continue
        e = [
            (up + g * (one.t[after] - at)) / (down + g * (at - one.t[after - 1]))
            for at in (end - step, end)
        ]
        found.append(min(max(scenario.scene.restitution, min(e)), max(e)))
    return float(np.median(found)) if found else None


def apex_change(one: Trajectory, _: None, scenario: Scenario) -> float | None:
    """In percent a bounce of a ball on a level floor: parabolas are fitted to the three samples
    about the highest of each flight, from one collision to the next.

    A rise must take five intervals; where the next flight is shorter than its due time, its highest
    sample counts.
    """
    if not scenario.name.startswith("bouncing_ball"):
        return None
    g, e, h = -scenario.scene.gravity[1], scenario.scene.restitution, scenario.sample_interval
    y, hits = one.position[:, 0, 1] - scenario.scene.radius[0], one.collisions.t
    flights = np.searchsorted(hits, one.t + 1e-9)  # how many collisions come before a sample
    tops = {}
    for flight in range(len(hits) + 1):
        inside = np.flatnonzero(flights == flight)
        if len(inside) < 3:
            continue
        k = inside[np.argmax(y[inside])] if flight else 1
        if k - 1 in inside and k + 1 in inside:
            a, b, c = np.polyfit([-1, 0, 1], y[k - 1 : k + 2], 2)
            if abs(2 * a / (g * h**2) + 1) < 0.01:
                tops[flight] = c - b**2 / (4 * a)
    changes = []
    for flight, height in tops.items():
        if flight == len(hits):
            continue
        due = hits[flight] + e * np.sqrt(2 * height / g)
        if due - hits[flight] < 5 * h or due + h > one.t[-1]:
            continue
        rise = (one.t > hits[flight]) & (one.t <= due)
        changes.append(tops.get(flight + 1, y[rise].max()) / height / e**2 - 1)
    return float(100 * np.mean(changes)) if changes else None


OWN: dict[str, Callable[..., float | None]] = {
    "position_max_radii": largest(radii),
    "position_rms_radii": root_mean_square(radii),
    "position_max": largest(distance),
    "position_rms": root_mean_square(distance),
    "angle_max": largest(turn),
    "angle_rms": root_mean_square(turn),
    "time_to_1pct_s": time_to_1pct,
    "momentum_error": momentum_error,
    "angular_momentum_error": angular_momentum_error,
    "energy_created": energy_created,
    "penetration_radii": penetration,
    "restitution": restitution,
    "apex_change": apex_change,
}


def differences(
    table: pd.DataFrame, known: dict[str, Trajectory], scenario: Scenario
) -> tuple[int, list[str]]:
    count, wrong = 0, []
    for row in table[table.metric.isin(OWN)].itertuples():
        one, other = known[f"{row.engine}:{row.profile}"], known.get(row.versus)
        if other is not None:
            k = min(len(one), len(other))
            one, other = first(one, k), first(other, k)
        own = OWN[row.metric](one, other, scenario)
        if own is None:
            continue
        count += 1
        if own != row.value and abs(own - row.value) > ROUNDING * abs(row.value) + FLOAT64:
            wrong.append(
                f"{scenario.name} {row.engine}:{row.profile} {row.metric} {row.versus}:"
                f" {row.value}, not {own}"
            )
    return count, wrong


def first(trajectory: Trajectory, k: int) -> Trajectory:
    names = ("t", "position", "velocity", "angle", "angular_velocity")
    return replace(trajectory, **{name: getattr(trajectory, name)[:k] for name in names})


def compared(name: str) -> tuple[pd.DataFrame, dict[str, Trajectory], Scenario]:
    scenario = catalogue.scenario(name)
    runs = [
        play(ENGINES[engine].make(), engine, scenario, scenario.dt(scenario.substeps[1]))
        for engine in PLAYED
    ]
    known = {run.name: run.trajectory for run in runs if run.trajectory is not None}
    known["truth"] = scenario.truth(scenario.times)
    return compare(scenario, runs).table, known, scenario


def test_the_metrics_come_out_again_from_the_trajectories(record_property: Record):
    count, wrong, met = 0, [], set()
    for name in SCENES:
        table, known, scenario = compared(name)
        of_scene, wrong_of_scene = differences(table, known, scenario)
        count, wrong, met = count + of_scene, wrong + wrong_of_scene, met | set(table.metric)
    record_property(
        "found",
        f"metrics: {count} numbers of {len(SCENES)} scenes, {len(wrong)} come out otherwise",
    )

    assert not wrong
    assert set(OWN) <= met
    assert count > 1000


@pytest.mark.parametrize("metric", OWN)
def test_a_metric_that_is_off_by_a_millionth_is_noticed(metric: str):
    table, known, scenario = compared(WITH.get(metric, "oblique_e09"))
    count, wrong = differences(table, known, scenario)
    table.loc[table.metric == metric, "value"] = table.value * (1 + 1e-6) + 1e-6

    assert count
    assert not wrong
    assert differences(table, known, scenario)[1]
