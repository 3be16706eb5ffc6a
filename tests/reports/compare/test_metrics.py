"""The judge judged: metrics of trajectories whose faults were put in by hand."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest

from crosscheck2d.adapters.play import play
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare import laws
from crosscheck2d.reports.compare.comparison import COLUMNS, compare
from crosscheck2d.reports.compare.delays import jumps_of
from crosscheck2d.reports.compare.laws import cached
from crosscheck2d.reports.compare.metrics import METRICS
from crosscheck2d.reports.compare.view import NOT_JUDGED, View, cut
from crosscheck2d.reports.page.findings import nearest, refusals
from crosscheck2d.reports.page.summary import summarize
from crosscheck2d.scenarios.catalogue import SCENARIOS, scenario
from crosscheck2d.scenarios.families.placing import lay_out
from crosscheck2d.scenarios.model import Scenario, Thrust, Trajectory
from crosscheck2d.scenarios.truth.exact import with_oracle
from tests.adapters.broken_engines import NanAtStep7
from tests.reports.compare.answers import beside_truth, one_disk, run_alone, run_engine, truth_of

WITH_TRUTH = [name for name in SCENARIOS if scenario(name).truth]


def value(metric: str, view: View) -> float:
    return METRICS[metric].of(view).value


@pytest.mark.parametrize("name", WITH_TRUTH)
def test_the_truth_against_itself_is_zero(name: str):
    one, truth = truth_of(name)
    view = beside_truth(one, one.dt(1), truth, truth)

    for metric, row in METRICS.items():
        found = row.of(view) if "truth" in row.against else None
        if found is not None and not found.note.startswith(f"{NOT_JUDGED}: "):
            expected = np.inf if row.better == "higher" else 0.0
            assert found.value == expected, metric


@pytest.mark.parametrize("name", WITH_TRUTH)
def test_the_truth_keeps_the_laws(name: str):
    one, truth = truth_of(name)
    view = View(one, one.dt(1), truth)

    laws_kept = ("momentum_error", "angular_momentum_error", "energy_error", "energy_created")
    for metric in (*laws_kept, "penetration_radii"):
        if (found := METRICS[metric].of(view)) is not None:
            # A few hundred roundings of terms of the size of the scale; angular momentum squares
            # the distances.
            assert found.value < 1e-12, metric


@pytest.mark.parametrize("name", ["head_on_equal_e09", "line_gas", "ping_pong"])
def test_a_disk_moved_by_a_millimetre_reads_a_millimetre(name: str):
    one, truth = truth_of(name)
    position = truth.position.copy()
    k, disk = len(truth) // 2, one.scene.n - 1
    position[k, disk] += [0.0006, 0.0008]
    found = METRICS["position_max"].of(
        View(one, one.dt(1), replace(truth, position=position), truth)
    )

    # the rounding of x + 0.0008 at |x| < 20, over 1e-3
    assert found.value == pytest.approx(1e-3, rel=1e-9)
    assert (found.disk, found.at) == (disk, truth.t[k])


def test_momentum_that_leaks_is_seen():
    one, truth = truth_of("head_on_equal_e1")
    velocity = truth.velocity.copy()
    velocity[-1, 0] *= 1.01
    found = value("momentum_error", View(one, one.dt(1), replace(truth, velocity=velocity)))
    share = np.linalg.norm(truth.velocity[-1, 0]) / np.linalg.norm(truth.velocity[-1], axis=1).sum()

    assert found == pytest.approx(0.01 * share, rel=1e-6)  # digits of 1.01 v - v


def test_energy_that_is_created_is_seen():
    one, truth = truth_of("box_billiard")
    spin = (truth.angular_velocity[0] ** 2 @ one.scene.inertia) / 2
    velocity = truth.velocity.copy()
    velocity[len(truth) // 2 :] *= 1.01
    found = value("energy_created", View(one, one.dt(1), replace(truth, velocity=velocity)))
    kinetic = (truth.velocity[0] ** 2).sum() * one.scene.mass[0] / 2

    # Differences of energies that round in the last of 16 digits, over 2 % of them.
    assert found == pytest.approx(kinetic * (1.01**2 - 1) / (kinetic + spin), rel=1e-12)


def test_weight_and_thrust_are_accounted_for():
    scene = one_disk([0, 0], [1, 2], mass=[2], gravity=[0, -9.81])
    thrusts = [Thrust(0, 0.25, 0.6, [3.0, 1.0])]
    one = Scenario("thrust", "?", "", scene, 1.0, 0.1, thrusts=thrusts)

    # ten additions of float64
    assert value("momentum_error", run_alone(one, "reference:exercise")) < 1e-14


def test_deviation_is_measured_across_the_seam():
    one = scenario("asteroids")
    played = run_alone(one, "reference:exercise", 4).played
    # the box is 10 m wide
    moved = replace(played, position=played.position + [10.0, 0.0])

    # rounding of x + 10
    assert value("position_max", View(one, one.dt(4), moved, played)) < 1e-14


@pytest.mark.parametrize("e", ["e0", "e05", "e09", "e1"])
def test_restitution_is_read_off_the_velocities(e: str):
    one, truth = truth_of(f"oblique_{e}")

    # Sampled velocities are exact up to rounding; the quotient amplifies it by v / v_n, below 10
    # here.
    assert value("restitution_error", View(one, one.dt(1), truth)) < 1e-14


# In heavy_on_light it presses the light disk through the floor, which no impulse explains.
REFLECTED = [n for n in SCENARIOS if n != "heavy_on_light" and not scenario(n).scene.friction]


@pytest.mark.parametrize("name", REFLECTED)
def test_the_reference_has_the_restitution_of_the_scene_in_every_scene(name: str):
    # Its impulse is exact, so what is read off its samples is e, or the reading is wrong; it knows
    # no friction.
    one = scenario(name)
    view = run_alone(one, "reference:exercise", one.substeps[0])
    found = METRICS["restitution_error"].of(view)

    # Rounding of v, twice over the closing speed: once in the normal, once in e. The slowest graze
    # here is 1e-3 v.
    assert found is None or np.isnan(found.value) or found.value < 1e-8


@pytest.mark.parametrize("metric", METRICS)
def test_every_metric_is_a_number_or_silent_for_any_trajectory(metric: str):
    scene = replace(scenario("box_billiard").scene, inertia=np.array([np.inf]))
    one = replace(scenario("box_billiard"), scene=scene)
    assert one.truth is not None
    truth = one.truth(one.times)
    huge = replace(truth, position=truth.position * 1e200, velocity=truth.velocity * 1e200)
    still = replace(truth, position=truth.position * 0, velocity=truth.velocity * 0)
    for played in (huge, still, cut(truth, 1)):
        for other in (None, cut(truth, len(played))):
            kind = "itself" if other is None else "truth"
            if kind in METRICS[metric].against:
                beside = View(
                    one, one.dt(1), played, other, None if other is None else jumps_of(truth, one)
                )
                with np.errstate(over="ignore", invalid="ignore"):  # as `compare` does
                    found = METRICS[metric].of(beside)
                assert found is None or isinstance(found.value, float | int)


def test_a_run_that_diverged_earns_a_status_and_no_score():
    one = scenario("slow_collision")
    run = play(NanAtStep7(), "reference:exercise", one, one.dt(1))
    table = compare(one, [run, run_engine(one, "pymunk:matched")]).table

    assert run.trajectory is not None
    assert table[table.engine == "reference"].metric.tolist() == ["status"]
    assert table.note.str.contains("of disk 0 is not finite").any()
    assert "reference:exercise" not in set(table.versus)


def test_to_refuse_a_scene_does_not_help_in_the_ranking():
    one, two = scenario("slow_collision"), scenario("near_miss")
    runs = {
        name: [run_engine(scene, name, 4) for scene in (one, two)]
        for name in ("reference:exercise", "box2d:shipped")
    }
    refused = Run("pymunk", "matched", one.name, one.dt(4), "unsupported", "too hard")
    perfect = replace(runs["reference:exercise"][1], engine="pymunk", profile="matched")
    tables = [
        compare(replace(one, substeps=(4,)), [refused, *(each[0] for each in runs.values())]),
        compare(replace(two, substeps=(4,)), [perfect, *(each[1] for each in runs.values())]),
    ]

    said = nearest(summarize(tables))
    assert said.startswith("Nearest to the exact answers: reference:exercise")
    assert "pymunk:matched" not in said
    assert refusals(tables) == ["pymunk:matched refused 1 cell: too hard."]


def test_a_disk_that_leaves_its_box_has_gone_through_a_wall():
    one, truth = truth_of("box_billiard")
    away = replace(truth, position=truth.position + np.linspace(0, 50, len(truth))[:, None, None])

    assert value("disks_tunnelled", View(one, one.dt(1), truth)) == 0
    assert value("disks_tunnelled", View(one, one.dt(1), away)) == 1


@pytest.mark.parametrize(
    ("heights", "through"),
    [
        ([0.3, 0.0, -0.3], True),
        ([0.3, 1e-17, -0.3], True),
        ([0.3, -1e-17, 0.0, -0.3], True),
        ([0.3, 0.0, 0.3], False),
        ([0.3, -1e-17, 0.3], False),
        ([0.0, 0.3, 0.4], False),
    ],
)
@pytest.mark.parametrize("x", [0.5, 1.0], ids=["over a piece", "over a joint"])
def test_a_sample_on_the_wall_itself_hides_no_crossing_and_makes_none(
    heights: list[float], through: bool, x: float
):
    wall = [[[-1.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [3.0, 0.0]]]
    scene = one_disk([x, heights[0]], walls=wall)
    position = np.array([[[x, height]] for height in heights])
    still = np.zeros((len(heights), 1))
    moved = Trajectory(np.arange(len(heights)), position, 0 * position, still, still)

    assert bool(laws.wall_crossings(moved, scene)) is through


def test_an_explosion_does_not_make_itself_small():
    one, truth = truth_of("line_gas")
    velocity = truth.velocity.copy()
    velocity[len(truth) // 2 :] *= 1000

    assert value("energy_error", View(one, one.dt(1), replace(truth, velocity=velocity))) > 1e5


def test_falling_through_a_wrap_is_no_energy_error():
    scene = one_disk([0, 0], gravity=[0, -1], wrap=[[-1, -1], [1, 1]])
    one = Scenario("rain", "?", "", scene, 5.0, 0.1)
    view = run_alone(one, "reference:exercise")

    assert METRICS["energy_error"].of(view) is None
    assert METRICS["energy_created"].of(view) is None


def test_comparison_stops_where_the_other_ends():
    _, truth = truth_of("line_gas")
    short = cut(truth, 100)

    assert len(short) == 100
    assert short.collisions.t[-1] <= short.t[-1]
    assert len(short.collisions) == (truth.collisions.t <= truth.t[99]).sum()


def test_the_table_has_failures_too_and_every_pair_once():
    one = scenario("head_on_equal_e1")
    names = ["reference:exercise", "reference:lesson", "pymunk:matched"]
    runs = [run_engine(one, name, k) for name in names for k in (1, 2)]
    reason = "mass 1e+300 does not fit into float32"
    refused = Run("box2d", "matched", one.name, one.dt(1), "unsupported", reason)
    table = compare(one, [*runs, refused]).table
    status = table[table.metric == "status"]
    pairs = table[~table.versus.isin(["itself", "truth"]) & (table.metric == "position_rms")]

    assert list(table.columns) == list(COLUMNS)
    assert status.note.tolist() == [f"unsupported: {reason}"]
    assert len(pairs) == 2 * 3  # two dt, three pairs
    assert not table.duplicated(["scenario", "engine", "profile", "dt_s", "metric", "versus"]).any()


def test_without_a_truth_nothing_is_called_an_error_of_position():
    one = replace(scenario("gas_of_100"), duration=0.5, truth=None)
    runs = [run_engine(one, name, 4) for name in ("reference:exercise", "pymunk:matched")]
    table = compare(one, runs).table

    assert set(table.versus) == {"itself", "pymunk:matched"}


def test_where_the_oracle_refuses_the_comparison_says_why():
    scene = lay_out(position=[[0, 0], [0.3, 0]], velocity=[[0, 0], [0, 0]], radius=0.2, mass=[1, 1])
    refused = compare(with_oracle(Scenario("two", "?", "", scene, 1.0, 0.1)), [])

    assert refused.truth is None
    assert "disk 0 and disk 1 overlap by 0.1 m" in refused.scenario.without_truth


# The cache of the laws.


def test_a_law_is_computed_once_for_the_same_objects_and_again_for_a_copy():
    computed = []
    law = cached(lambda one, other: computed.append((one, other)) or one.position + other.position)
    one, other = (scenario(name).scene for name in ("near_miss", "oblique_e1"))
    again = replace(other)

    found = law(one, other)
    assert law(one, other) is found
    assert law(one, again) is not found
    assert computed == [(one, other), (one, again)]
    with pytest.raises(ValueError, match="read-only"):
        found[0] = 0.0


def test_what_was_found_is_forgotten_with_the_first_object():
    law = cached(lambda one, other: one.position + other.position)
    one, other = (scenario(name).scene for name in ("near_miss", "oblique_e1"))
    law(one, other)
    kept = weakref.ref(other)

    del other
    gc.collect()
    assert kept() is not None
    del one
    gc.collect()
    assert kept() is None
