"""The thermometer of the stability report: it reads the literature's numbers off an exact gas, and
notices one that is wrong."""

from __future__ import annotations

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest

from crosscheck2d.adapters.engines import changed
from crosscheck2d.adapters.play import play
from crosscheck2d.adapters.pymunk import Pymunk
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.stability import limits
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.cases_many import RADIUS, gas, wrapped_run
from crosscheck2d.reports.stability.limits import QUICK, DrivenEngine, LimitSearch, play_as
from crosscheck2d.reports.stability.predicates import judge
from crosscheck2d.reports.stability.predicates_gas import (
    BLOCKS,
    ERRORS,
    block_error,
    compressibility,
    counted,
    gas_in_box,
    in_blocks,
    literature,
    momentum_drifts,
    shares_of_speeds,
    temperatures_part,
    wrong_gas,
)
from crosscheck2d.scenarios.catalogue import SCENARIOS
from crosscheck2d.scenarios.model import Scenario, Trajectory, frozen

EXACT = "event_driven:float64"


def played(engine: str, scenario: Scenario) -> Trajectory:
    run = play_as(engine, scenario)
    assert run.status == "ok"
    assert run.trajectory is not None
    return run.trajectory


def verdict(predicate, scenario: Scenario, trajectory: Trajectory):
    return judge(predicate, scenario, Run("made", "up", "gas", 1.0, trajectory=trajectory))


def as_in_literature(scenario: Scenario, trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """The rate of collisions and the pressure, in blocks, over those of the literature."""
    expected, collisions = literature(scenario), trajectory.collisions
    rate = counted(trajectory, collisions.j >= 0, np.ones(len(collisions)))
    force = counted(trajectory, collisions.j < 0, collisions.impulse)
    return rate / expected.rate, force / expected.force


@pytest.mark.parametrize(("packing", "z"), [(0.1, 1.23614), (0.3, 2.06326), (0.5, 4.1063)])
def test_the_virial_series_is_that_of_clisby_and_mccoy(packing: float, z: float):
    # Their ten coefficients resummed; Henderson's (1 + eta2 / 8) / (1 - eta)2 is within 0.5 % up to
    # 0.5.
    assert compressibility(packing) == pytest.approx(z, abs=1e-4)
    assert compressibility(packing) == pytest.approx(
        (1 + packing**2 / 8) / (1 - packing) ** 2, rel=5e-3
    )


def test_in_a_large_box_the_rate_is_enskogs_and_the_pressure_that_of_the_bulk():
    # 4 / sqrt(pi) (Z - 1) sqrt(kT / m) / sigma collisions a disk; a wall of a million diameters is
    # no matter.
    radius, packing, n = 0.5, 0.3, 10**12
    size = np.full(2, sqrt(n * pi * radius**2 / packing))
    found, z = gas_in_box(n, radius, size, 1.0), compressibility(packing)

    assert 2 * found.rate / n == pytest.approx(4 / sqrt(pi) * (z - 1), rel=1e-5)
    assert found.force / (2 * size.sum()) == pytest.approx(z * n / size.prod(), rel=1e-5)


@pytest.mark.parametrize("packing", [0.2, 0.4, pytest.param(0.6, marks=pytest.mark.slow)])
def test_an_exact_gas_between_walls_has_the_rate_and_the_pressure_of_the_literature(packing: float):
    # Two gases of a hundred disks, within 1 % (scaled particle theory, corners) and four block
    # errors. The negative control: the pressure of a bulk of the same packing, without a thought of
    # walls, is not within that.
    gases = [gas(packing, run, rows=10, columns=10, steps=8000, every=80) for run in range(2)]
    runs = [as_in_literature(scenario, played(EXACT, scenario)) for scenario in gases]
    rates, forces = (np.concatenate(blocks) for blocks in zip(*runs))
    scene = gases[1].scene
    size = scene.walls.max(axis=(0, 1)) - scene.walls.min(axis=(0, 1))
    temperature = (scene.velocity**2).sum() / 2 / scene.n
    pressure = compressibility(packing) * packing / (pi * RADIUS**2) * temperature
    bulk = pressure * 2 * size.sum() / literature(gases[1]).force

    def within(blocks: np.ndarray) -> bool:
        return abs(blocks.mean() - 1) < 0.01 + ERRORS * block_error(blocks)

    assert within(rates)
    assert within(forces)
    assert not within(forces / bulk)


def test_an_exact_gas_passes_and_one_that_is_too_hot_does_not():
    # All of it, for two seeds; a gas hotter by a fifth collides more often by a tenth.
    for run in range(2):
        scenario = CASES["thermometer"].scene(0.4, run)
        assert not judge(wrong_gas, scenario, play_as(EXACT, scenario)).failed
    hot = replace(
        scenario, scene=replace(scenario.scene, velocity=scenario.scene.velocity * sqrt(1.2))
    )
    reading = verdict(wrong_gas, scenario, played(EXACT, hot))

    assert reading.failed
    assert reading.id in ("rate", "pressure")


def test_speeds_that_are_not_maxwells_are_noticed():
    rng, k, n = np.random.default_rng(0), 500, 100
    sampled = rng.normal(size=(k, n, 2))
    angle = rng.uniform(0, 2 * pi, (k, n))
    same = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    scenario = CASES["thermometer"].scene(0.4, 0)
    one = played(EXACT, scenario)
    late = scenario.times[: k + 1][1:]
    shares = {
        name: in_blocks(shares_of_speeds(replace(one, t=late, velocity=frozen(velocity))))
        for name, velocity in (("sampled", sampled), ("same", same))
    }

    assert shares["sampled"].shape == (BLOCKS, 5)
    assert np.abs(shares["sampled"].mean(axis=0) - 0.2).max() < 0.005  # 50 000 samples: 0.0018
    assert shares["same"].max() == 1.0
    equal = one.velocity / np.linalg.norm(one.velocity, axis=2, keepdims=True)
    speed = np.linalg.norm(one.velocity[0], axis=1)
    alike = replace(one, velocity=frozen(equal * speed.mean()))
    assert verdict(wrong_gas, scenario, alike).id == "not Maxwell"


def test_equipartition_holds_in_an_exact_gas_up_to_1e4_and_a_hotter_kind_is_noticed():
    # Block errors tell chance from heat: disks of twice the temperature fail, whatever their mass.
    for ratio in (1.5, 100.0, 1e4):
        scenario = CASES["equipartition"].scene(ratio, 0)
        one = played(EXACT, scenario)
        assert not verdict(temperatures_part, scenario, one).failed
        heavy = scenario.scene.mass == ratio
        hotter = one.velocity * np.where(heavy, sqrt(2), 1.0)[:, None]
        assert verdict(temperatures_part, scenario, replace(one, velocity=frozen(hotter))).failed


def test_without_walls_momentum_stays_to_rounding_in_every_engine_and_a_leak_is_noticed():
    # float64 to 1e-14, float32 to 1e-6, in 1000 steps; one disk stopped at the end is one part in
    # some twenty.
    scenario = wrapped_run(1000.0, 0)
    for engine, bound in (
        ("reference:exercise", 1e-14),
        ("pymunk:matched", 1e-14),
        ("box2d:matched", 1e-6),
        ("box2d_v3:matched", 1e-6),
    ):
        one = played(engine, scenario)
        reading = verdict(momentum_drifts, scenario, one)
        assert not reading.failed
        assert reading.value < bound
        velocity = np.array(one.velocity)
        velocity[-1, 0] = 0.0
        assert verdict(momentum_drifts, scenario, replace(one, velocity=frozen(velocity))).failed


@pytest.mark.slow
def test_finding_collisions_late_costs_a_dense_gas_its_rate_and_its_pressure():
    # At packing 0.6 an engine that detects at the end of a step and leaves overlaps has a tenth too
    # few collisions; in order within it, not. As pymunk is matched now, it removes an overlap in a
    # step, and loses less.
    scenario, name = CASES["thermometer"].scene(0.6, 0), "pymunk:matched"
    leaving = DrivenEngine(name, lambda: changed(name, elastic_bias=1.0))
    run = limits.played(leaving, scenario)
    in_order = judge(wrong_gas, scenario, play_as("reference:ordered", scenario))
    late = judge(wrong_gas, scenario, run)
    assert run.trajectory is not None

    for blocks in as_in_literature(scenario, run.trajectory):
        assert blocks.mean() == pytest.approx(0.9, abs=0.02)
    assert late.id in ("rate", "pressure")
    assert late.failed
    assert not in_order.failed


def test_pymunk_loses_energy_by_impulses_that_a_contact_inherits():
    # Shipped it remembers one for three steps: what it inherits is not given again, but may be
    # taken back. Forgotten as soon as they part, contacts keep the energy but for what 50
    # iterations leave over.
    scenario = CASES["fast_gas"].scene(0.6, 0)
    lost = {}
    for steps in (3, 1):
        engine = changed("pymunk:matched", collision_persistence=steps, iterations=50)
        run = play(engine, "pymunk:changed", scenario, scenario.dt(10))
        assert run.trajectory is not None
        energy = laws.energy(run.trajectory, scenario.scene)
        lost[steps] = 1 - energy[-1] / energy[0]

    assert lost[3] > 0.05
    assert abs(lost[1]) < 1e-6


@pytest.mark.parametrize("profile", ["shipped", "matched"])
def test_what_pymunk_tells_of_its_collisions_is_what_it_gives_only_if_it_forgets_contacts(
    profile: str,
):
    # A heavy disk drives a light one against a wall: in all, impulses of twice the heavy one's
    # momentum, once each.
    scenario = SCENARIOS["galperin_314"]
    dt = scenario.dt(4)
    reported = {}
    for steps in (3, 1):
        run = play(Pymunk(profile, collision_persistence=steps), "pymunk:changed", scenario, dt)
        assert run.trajectory is not None
        collisions, velocity = run.trajectory.collisions, run.trajectory.velocity[:, :, 0]
        reported[steps] = collisions.impulse[collisions.j >= 0].sum() / (
            scenario.scene.mass[1] * np.ptp(velocity[:, 1])
        )

    assert reported[1] == pytest.approx(1.0, abs=1e-9)
    assert reported[3] > 10


@pytest.mark.long
@pytest.mark.parametrize("engine", ["pymunk:shipped", "box2d:matched"])
def test_the_limit_of_a_fast_gas_is_that_of_other_draws_too(engine: str):
    def fails_at(seeds: int, by_chance: float) -> float:
        case = CASES["fast_gas"]
        other = replace(case, scene=lambda x, run: case.scene(x, run + seeds), by_chance=by_chance)
        return LimitSearch(other, engine, QUICK).limit().fails_at

    limits = [fails_at(seeds, CASES["fast_gas"].by_chance) for seeds in (0, 100, 200)]
    first = [fails_at(seeds, 0.0) for seeds in (0, 100, 200)]
    print(limits, first)

    assert max(limits) < 1.5 * min(limits)
    assert min(first) < 0.75 * min(limits)
