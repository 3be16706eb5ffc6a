"""Times are of `step` alone, in interleaved rounds, and every sample is kept."""

from __future__ import annotations

from contextlib import closing
from functools import partial
from pathlib import Path
from time import sleep

import numpy as np
import pandas as pd
import pytest

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.host.engine import TEMPLATES, row_of_file
from crosscheck2d.reports.run.stepping import CALL, EMPTY, READ, Spent
from crosscheck2d.reports.run.timing import FEWEST_ROUNDS, WARM_UP, Sample, Timed, interleaved
from crosscheck2d.reports.speed import ladder, sizes
from crosscheck2d.reports.speed.ladder import scored
from crosscheck2d.reports.speed.measure import IN_PILE, Measured, samples_table
from crosscheck2d.reports.speed.tables import end_of_all_pairs, pile, summed_up
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.model import Scene
from tests.reports.speed.clockwork import Sleeper

EACH = 1e-3
SLACK = 0.5  # of a fixed time: a busy machine wakes a sleeper late, never early


def fixed(seconds: float, wrapping: float = 0.0) -> Timed:
    return Timed(f"{seconds}", lambda: Spent(seconds, wrapping), 2.0)


def table(samples: list[Sample]) -> pd.DataFrame:
    return pd.DataFrame([sample._asdict() for sample in samples])


def timed(rounds: int, budget: float, *sleepers: partial) -> pd.DataFrame:
    """A row of `summed_up` for each of these, in `near_miss`."""
    engines = {("sleeper:own", 1, k): make for k, make in enumerate(sleepers)}
    return summed_up(table(ladder.times_of("near_miss", 0, engines, rounds, budget)), ["key"])


def test_an_engine_that_sleeps_a_fixed_time_costs_that_time():
    # Loading takes five times as long as a step, and hearing of collisions fifty times: neither is
    # in it.
    part = scored("near_miss", 0).scenario
    steps = part.intervals
    best = timed(3, 1.0, partial(Sleeper, EACH)).best.iloc[0]

    assert steps * EACH / part.duration <= best <= (1 + SLACK) * steps * EACH / part.duration


def test_what_wrapping_in_python_took_is_given_separately():
    # A quarter of each step goes into wrapping: it is left out of the cost, and reported beside it.
    row = timed(3, 1.0, partial(Sleeper, EACH, EACH / 4)).iloc[0]

    rate = scenario("near_miss").intervals / scenario("near_miss").duration
    assert row.wrapping == pytest.approx(rate * EACH / 4)
    assert rate * EACH * 3 / 4 <= row.best <= rate * EACH * (3 / 4 + SLACK)


def test_an_engine_against_itself_reads_one():
    # The noise floor of two sleepers is the clock's own: sleeping is never early, and the fastest
    # is on time.
    best = timed(15, 3.0, *[partial(Sleeper, EACH)] * 2).best

    assert best[1] / best[0] == pytest.approx(1.0, abs=0.05)


def test_every_round_visits_all_in_an_order_of_its_own_and_keeps_every_sample():
    what = [fixed(0.1 * k) for k in range(1, 8)]
    samples, again = interleaved(what, 6, 100.0, seed=3), interleaved(what, 6, 100.0, seed=3)
    rounds = table(samples).groupby("round").key.agg(list)

    assert sorted(rounds.index) == list(range(WARM_UP, 6))
    assert all(sorted(keys) == sorted(one.key for one in what) for keys in rounds)
    assert len({tuple(keys) for keys in rounds}) > 1
    assert [sample.key for sample in samples] == [sample.key for sample in again]


def test_what_is_slow_sits_out_the_rounds_left_but_not_the_first():
    # Its time is used up after one sample; the other goes on.
    samples = table(interleaved([fixed(0.1), fixed(9.0)], 8, 1.0, seed=0))
    rounds = samples.groupby("key")["round"].agg(list)

    assert rounds["9.0"] == list(range(WARM_UP, FEWEST_ROUNDS))
    assert rounds["0.1"] == list(range(WARM_UP, 8))


def test_a_sample_is_filled_with_runs_and_reported_per_unit():
    sample = interleaved([fixed(1.01e-4)], 1, 1.0, seed=0)[0]

    assert sample.runs == 10
    assert sample.cost == pytest.approx(1.01e-4 / 2)


def test_the_summary_leaves_the_warm_up_out_and_has_quartiles_and_the_fastest():
    costs = [100.0, 1.0, 2.0, 3.0, 4.0, 9.0]
    samples = [Sample("a", k, 0, cost, 0.0, 1) for k, cost in enumerate(costs, start=WARM_UP)]
    row = summed_up(table(samples), ["key"]).iloc[0]

    assert (row.cost, row.low, row.high, row.best, row.rounds) == (3.0, 2.0, 4.0, 1.0, 5)


def test_what_grows_as_a_power_of_n_gives_the_power_and_stops_where_it_would_take_too_long():
    n = np.array([10.0, 100.0, 1000.0, 10_000.0])
    course = [(int(k), float(k**1.5)) for k in n]

    assert sizes.exponent(n, n**1.5) == pytest.approx((1.5, 1.5, 1.5))
    assert sizes.extrapolated_cost(course, 100_000) == pytest.approx(1e5**1.5)
    assert np.isnan(sizes.exponent(n[:3], n[:3])).all()


@pytest.mark.slow
def test_no_gas_grows_older_than_it_may_however_often_it_is_sampled():
    # A gas that loses energy falls asleep, so whoever took more steps of it would look cheaper.
    ages: list[int] = []

    class Ageing(Sleeper):
        def load(self, scene: Scene, dt: float) -> None:
            super().load(scene, dt)
            ages.append(0)

        def step(self, count: int = 1) -> None:
            ages[-1] += count

    sizes.costs({"quick:own": partial(Ageing, 0.0)}, (10,), 12, 1.0, patience=1.0, seed=0)

    assert len(ages) > 12
    assert max(ages) <= sizes.RESTART_AFTER + sizes.WARM_STEPS


def test_the_worst_step_is_that_of_the_engine_and_not_of_the_machine():
    # The fourth step of a gas takes 5 ms; a pause that comes in one replay alone is no step.
    pauses = iter([*[0.0] * 7, 0.05, *[0.0] * 99])  # in the first replay, at the seventh step

    class Slow(Sleeper):
        def load(self, scene: Scene, dt: float) -> None:
            super().load(scene, dt)
            self.taken = 0

        def step(self, count: int = 1) -> None:
            self.taken += count
            sleep(next(pauses) + (5e-3 if self.taken == 4 else 0.0))

    gas = sizes.RunningGas.__new__(sizes.RunningGas)
    gas.engine, gas.scene, gas.first = Slow(0.0), sizes.gas(3, 0), 1

    # a sleep may take longer, the 50 ms would stand out
    assert 5e-3 <= gas.worst_step(1e-3, 8e-3) < 0.04


@pytest.mark.parametrize(
    ("costs", "sentence"),
    [
        ({10: 2.0, 100: 8.0}, "Testing all pairs costs more than fast:own from 32 disks on."),
        ({10: 0.5, 100: 1.0}, ""),  # dearer everywhere
        ({10: 99.0, 100: 999.0}, ""),  # nowhere
    ],
)
def test_where_all_pairs_stop_paying_is_said_in_a_sentence(costs: dict[int, float], sentence: str):
    # All pairs cost 1 and 16: equal to an engine of 2 and 8 at the square root of 10 times 100.
    rows = [("reference", "exercise", n, cost) for n, cost in ((10, 1.0), (100, 16.0))]
    rows += [("fast", "own", n, cost) for n, cost in costs.items()]
    table = pd.DataFrame(rows, columns=["engine", "profile", "n", "cost"])

    assert end_of_all_pairs(table) == sentence


def test_a_settled_pile_costs_less_asleep_and_nothing_in_it_moves():
    engines = {
        ("pymunk:matched", change): partial(ENGINES["pymunk:matched"].make, **settings)
        for change, settings in (("", {}), ("sleeping", {"sleep_time_threshold": 0.5}))
    }
    samples = sizes.pile_costs(engines, 5, 0.1, seed=0)
    least = {key: min(s.cost for s in samples if s.key == key) for key in engines}
    with closing(ENGINES["pymunk:matched"].make()) as engine:
        start = sizes.pile(sizes.PILE)
        engine.load(start, sizes.DT)
        engine.step(sizes.SETTLED)
        moved = np.abs(engine.read().position - start.position).max()

    assert 3 * least["pymunk:matched", "sleeping"] < least["pymunk:matched", ""]
    assert moved < sizes.RADIUS / 5


def test_a_settled_pile_is_a_row_awake_and_asleep():
    known = dict.fromkeys(("dt_s", "copy_of", "place", "round", "wrapping"), 0)
    known |= {"kind": IN_PILE, "engine": "a", "profile": "b", "n": 100, "runs": 1}
    costs = (("", 2e-5), ("sleeping", 1e-6))
    samples = samples_table([known | {"change": change, "cost": cost} for change, cost in costs])

    (row,) = pile(Measured(samples=samples)).to_dict("records")
    assert row == {"name": "a:b", "n": 100, "": 20.0, "sleeping": 1.0}
    assert pile(Measured()).empty


def test_an_engine_that_would_take_too_long_a_step_stops_and_is_reported():
    engines = {"sleeper:own": partial(Sleeper, 2e-3)}
    samples, worst, stopped = sizes.costs(engines, (3, 4, 5), 1, 0.0, patience=1e-3, seed=0)

    assert {sample.key[1] for sample in samples} == {3, 4} == {sample.key[1] for sample in worst}
    assert list(stopped) == [("sleeper:own", 5)]
    assert "longer than 0.001 s" in stopped["sleeper:own", 5]


def test_the_gas_of_any_size_covers_the_same_share_and_overlaps_nowhere():
    for n in (3, 10, 100, 137):
        scene = sizes.gas(n, 0)
        side = scene.walls.max()
        apart = np.linalg.norm(scene.position[:, None] - scene.position, axis=2) + 9 * np.eye(n)

        assert n * np.pi * sizes.RADIUS**2 / side**2 == pytest.approx(sizes.COVERED)
        assert apart.min() > 2 * sizes.RADIUS
        assert scene.position.min() > sizes.RADIUS
        assert scene.position.max() < side - sizes.RADIUS


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "measured"),
    [("walls gravity", {READ}), ("walls gravity static", {EMPTY, CALL, READ})],
)
def test_what_a_file_refuses_is_not_timed(words: str, measured: set[str], tmp_path: Path):
    # Its steps in the scene are; the empty step needs a disk that cannot move.
    path = tmp_path / "ball.js"
    line = 'models = "disks walls gravity static forces rotation wrap"'
    text = TEMPLATES["javascript"].read_text()
    assert line in text
    path.write_text(text.replace(line, f'models = "{words}"'))
    make, who = row_of_file(path).make, "ball"
    samples = ladder.times_of("bouncing_ball_e09", 0, {(who, 1, 0): make}, 1, 0.1, also={who: make})

    assert {sample.key for sample in samples} == {(who, 1, 0), *((who, each) for each in measured)}
    assert all(sample.cost > 0 for sample in samples)
