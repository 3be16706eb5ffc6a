"""`crosscheck diff`: what got worse between two runs is found, what did not is not; scripts can
tell by the exit."""

import math
import random
import shutil
from collections.abc import Callable
from pathlib import Path
from statistics import median

import pandas as pd
import pytest

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.reports.commands.diff import (
    ROUNDING,
    Difference,
    Timing,
    difference,
    is_rounding,
    show_difference,
    timing,
)
from crosscheck2d.reports.page.report import make_report
from crosscheck2d.reports.run import suite
from crosscheck2d.reports.run.comparing import csv_of
from crosscheck2d.reports.run.results import COMMAND, RunResults
from crosscheck2d.reports.run.store import writing
from crosscheck2d.reports.run.suite import Means, RunPlan, carry_out
from crosscheck2d.reports.terminal.exits import Unusable
from crosscheck2d.reports.terminal.progress import Progress
from tests.reports.run.small_runs import read

PLAN = RunPlan(
    ["slow_collision", "near_miss"],
    {name: ENGINES[name] for name in ("pymunk:shipped", "pymunk:matched")},
    seed=0,
    dts=[],
    full=False,
    timings=10,  # s for one round, of which it takes a tenth: on a busy machine it fits, too
    command="test",
)


def run(folder: Path, workers: int) -> Path:
    with writing(folder, COMMAND) as store, Progress() as progress:
        carry_out(PLAN, Means(workers), store, progress)
        make_report(RunResults.read(store), progress.say)
    return folder


@pytest.fixture(scope="module")
def before(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run(tmp_path_factory.mktemp("diff") / "before", workers=2)


@pytest.fixture
def after(before: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(before, tmp_path / "after"))


def change_plan(folder: Path, change: Callable[[dict], object]) -> None:
    with writing(folder, COMMAND) as store:
        plan = store.get("run", "plan").value
        change(plan)
        store.put("run", "plan", plan)


def change_cells(folder: Path, change: Callable[[dict], object]) -> None:
    with writing(folder, COMMAND) as store:
        plan = store.get("run", "plan").value
        for task in plan["tasks"]["cell"]:
            row = store.get("cell", task[0])
            value = row.value | {"cell": task[0]}
            change(value)
            task[0] = value.pop("cell")
            store.put("cell", task[0], value, row.blob)
        store.put("run", "plan", plan)


def change_timings(folder: Path, change: Callable[[dict[str, dict]], object]) -> None:
    with writing(folder, COMMAND) as store:
        key = store.get("run", "plan").value["timing"]
        timing = store.get("timing", key).value
        change(timing["cells"])
        store.put("timing", key, timing)


def put_table(table: pd.DataFrame, folder: Path) -> None:
    with writing(folder, COMMAND) as store:
        store.put("run", "table", None, csv_of(table))


def elsewhere(plan: dict) -> None:
    plan["machine"].update(processor="abacus")


def verdicts_where(changed: Difference, column: str, text: str) -> set[str]:
    changes = changed.changes
    return set(changes.verdict[changes[column].str.contains(text)])


def exit_of(before: Path, after: Path) -> object:
    with pytest.raises(SystemExit) as left:
        show_difference(before, after)
    return left.value.code


@pytest.mark.slow
def test_the_numbers_do_not_depend_on_workers_or_order(
    before: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    run_all = suite.run_all

    def shuffled(tasks, *words):
        order = list(tasks.items())
        random.Random(4).shuffle(order)
        return run_all(dict(order), *words)

    monkeypatch.setattr(suite, "run_all", shuffled)
    again = run(tmp_path / "again", workers=1)
    assert (again / "deviations.csv").read_bytes() == (before / "deviations.csv").read_bytes()
    assert difference(before, again).changes.empty


def test_the_same_run_has_not_changed(
    before: Path, after: Path, capsys: pytest.CaptureFixture[str]
):
    assert exit_of(before, after) == 0
    assert "Nothing got worse." in capsys.readouterr().out


def test_a_number_between_two_engines_counts_for_both(before: Path, after: Path):
    same = difference(before, after).same

    assert set(same) == {"pymunk:shipped", "pymunk:matched"}
    assert same["pymunk:shipped"] == same["pymunk:matched"]


def test_runs_without_a_common_cell_are_not_said_to_have_got_worse(
    before: Path, after: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
):
    nothing = difference(before, after)._replace(shared=0)
    monkeypatch.setattr("crosscheck2d.reports.commands.diff.difference", lambda *_: nothing)

    with pytest.raises(SystemExit) as end:
        show_difference(before, after)

    assert end.value.code == 1
    out, err = capsys.readouterr()
    assert (out, "share no cell" in err) == ("", True)


def test_one_bit_in_a_cell_that_is_the_same_is_worse(before: Path, after: Path):
    table = pd.read_csv(after / "deviations.csv", dtype=str, keep_default_na=False)
    row = table.index[(table.metric == "position_max") & (table.versus == "truth")][0]
    table.loc[row, "value"] = repr(float(table.loc[row, "value"]) * (1 - 2**-53))
    put_table(table, after)
    [change] = difference(before, after).changes.itertuples()

    assert (change.verdict, "same cell, other bits" in change.what) == ("worse", True)
    assert exit_of(before, after) == 1


@pytest.mark.parametrize(("factor", "verdict"), [(2.0, "worse"), (0.5, "better")])
def test_where_versions_differ_the_metric_says_what_is_worse(
    before: Path, after: Path, factor: float, verdict: str
):
    change_cells(after, lambda cell: cell.update(cell=cell["cell"][::-1]))
    change_plan(after, lambda plan: plan["versions"].update(pymunk="8.0"))
    table = pd.read_csv(after / "deviations.csv")
    table.loc[(table.metric == "position_max") & (table.value > 1e-6), "value"] *= factor
    put_table(table, after)
    changed = difference(before, after)

    assert "differs in version: pymunk: 7.3.1 before, 8.0 after" in changed.warnings
    assert verdicts_where(changed, "what", "against truth") == {verdict}
    assert verdicts_where(changed, "what", "against pymunk") <= {"other"}


def test_a_verdict_that_fails_now_is_worse_and_one_that_passes_still_is_neither(
    before: Path, after: Path
):
    change_plan(after, elsewhere)
    table = pd.read_csv(after / "deviations.csv")
    rows = table.index[table.metric == "tunnelled"]
    table.loc[rows[0], "value"] = 1.0
    overlap = table.index[table.metric == "overlap"][0]
    table.loc[overlap, "value"] = 0.5 * table.loc[overlap, "bound"]
    put_table(table, after)

    now, back = difference(before, after), difference(after, before)
    assert set(now.changes.what) == {"tunnelled against itself", "overlap against itself"}
    assert verdicts_where(now, "what", "tunnelled") == {"worse"}
    assert verdicts_where(now, "what", "overlap") == {"other"}
    assert verdicts_where(back, "what", "tunnelled") == {"better"}


@pytest.mark.parametrize(
    ("moved", "verdict"),
    [
        (0.9e-9, ROUNDING),  # what the horizon of an exact answer allows
        (1.1e-9, "worse"),
    ],
)
def test_a_difference_within_rounding_is_neither_worse_nor_better(
    before: Path, after: Path, moved: float, verdict: str
):
    change_plan(after, elsewhere)
    table = pd.read_csv(after / "deviations.csv")
    rows = (table.metric == "position_max") & (table.versus == "truth")
    table.loc[rows, "value"] += moved
    put_table(table, after)

    assert list(difference(before, after).changes.verdict) == [verdict] * int(rows.sum())
    assert exit_of(before, after) == int(verdict == "worse")


@pytest.mark.parametrize(
    ("engine", "was", "now", "rounding"),
    [
        ("pymunk:matched", 1e-17, 1e-12, True),
        ("pymunk:matched", 1000.0, 1000.0 + 1e-7, True),  # relative where it is large
        ("pymunk:matched", 1e-6, 2e-6, False),
        ("box2d:matched", 1e-6, 5e-6, True),  # float32
        ("box2d:matched", 1e-6, 1e-5, False),
        ("a.js:own", 1e-6, 5e-6, False),  # a file's numbers are float64
        ("pymunk:matched", 1e-17, math.inf, False),
        ("pymunk:matched", math.nan, 1e-17, False),
    ],
)
def test_rounding_is_that_of_the_numbers_of_the_engine(
    engine: str, was: float, now: float, rounding: bool
):
    one, other, first, second = map(pd.Series, ([engine], ["box2d:matched"], [was], [now]))
    assert is_rounding(one, one, first, second).all() == rounding
    assert is_rounding(one, one, second, first).all() == rounding
    assert is_rounding(one, other, pd.Series([1e-6]), pd.Series([5e-6])).all()


def test_an_edited_scene_is_named_and_nothing_in_it_is_called_worse_or_better(
    before: Path, after: Path, capsys: pytest.CaptureFixture[str]
):
    before = Path(shutil.copytree(before, after.parent / "before"))
    for folder in (before, after):
        change_timings(folder, rounds_of([1.0] * 9))
    timed = {engine: one.n for engine, one in difference(before, after).timings.items()}

    theirs = {one["cell"] for one in read(after).records if one["scenario"] == "near_miss"}

    def edited(cell: dict) -> None:
        if cell["cell"] in theirs:
            cell.update(scene_hash="0" * 16, cell=cell["cell"][::-1], status="unsupported")

    def renamed(cells: dict[str, dict]) -> None:
        for key in theirs:
            cells[key[::-1]] = cells.pop(key)

    change_cells(after, edited)
    change_timings(after, renamed)
    table = pd.read_csv(after / "deviations.csv")
    table.loc[table.metric == "position_max", "value"] *= 2
    put_table(table, after)
    changed = difference(before, after)
    verdicts = {scene: verdicts_where(changed, "scenario", scene) for scene in PLAN.scenes}

    assert verdicts == {"near_miss": {"other", ROUNDING}, "slow_collision": {"worse"}}
    assert {engine: 2 * one.n for engine, one in changed.timings.items()} == timed
    assert [warning for warning in changed.warnings if "differs in scene: near_miss:" in warning]
    assert exit_of(before, after) == 1
    assert "near_miss: edited between the runs" in capsys.readouterr().out


def test_a_cell_that_fails_now_is_worse_and_the_other_way_round_better(
    before: Path, after: Path, capsys: pytest.CaptureFixture[str]
):
    first = read(after).records[0]["cell"]
    change_cells(
        after, lambda cell: cell.update(status="crashed") if cell["cell"] == first else None
    )

    [worse] = difference(before, after).changes.itertuples()
    [better] = difference(after, before).changes.itertuples()
    assert [(one.before, one.after, one.verdict) for one in (worse, better)] == [
        ("ok", "crashed", "worse"),
        ("crashed", "ok", "better"),
    ]
    assert exit_of(before, after) == 1
    assert "status: ok → crashed" in " ".join(capsys.readouterr().out.split())


def test_cells_that_only_one_run_has_are_named_and_not_worse(
    before: Path, after: Path, capsys: pytest.CaptureFixture[str]
):
    def without_shipped(plan: dict) -> None:
        shipped = {one["cell"] for one in read(before).records if one["profile"] == "shipped"}
        cells = plan["tasks"]["cell"]
        plan["tasks"]["cell"] = [task for task in cells if task[0] not in shipped]

    change_plan(after, without_shipped)
    cells = len(read(before).records) // 2

    assert exit_of(before, after) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert (
        f"only in {before}: {cells} cells of pymunk:shipped, in slow_collision and near_miss"
        in (said.replace("- ", "-"))
    )


def rounds_of(costs: list[float], again: float = 1.0) -> Callable[[dict], None]:
    def change(cells: dict[str, dict]) -> None:
        for times in cells.values():
            times["cost"] = costs
            if "again" in times:
                times["again"] = [cost * again for cost in costs]

    return change


def test_times_of_a_busy_machine_are_not_compared(before: Path, after: Path):
    change_timings(after, rounds_of([2.0] * 9, again=1.5))
    busy = difference(before, after)
    change_timings(after, rounds_of([2.0] * 9, again=1.05))
    quiet = Path(shutil.copytree(before, after.parent / "quiet"))
    change_timings(quiet, rounds_of([1.0] * 9))
    quieter = difference(quiet, after)

    assert busy.timings == {}
    assert any("a factor of 1.50" in warning for warning in busy.warnings)
    assert {one.verdict for one in quieter.timings.values()} == {"worse"}


@pytest.mark.parametrize(("machine", "verdicts"), [("same", {"worse"}), ("other", set())])
def test_timings_are_judged_on_one_machine_only(
    before: Path, after: Path, machine: str, verdicts: set[str]
):
    before = Path(shutil.copytree(before, after.parent / "before"))
    change_timings(before, rounds_of([1.0] * 9))
    change_timings(after, rounds_of([2.0] * 9))
    if machine == "other":
        change_plan(after, elsewhere)
    changed = difference(before, after)

    assert {one.verdict for one in changed.timings.values()} == verdicts
    assert any("abacus" in warning for warning in changed.warnings) == (machine == "other")


@pytest.mark.parametrize(
    ("ratios", "verdict"),
    [
        ([1.5] * 20, "worse"),  # sure and large
        ([1.1] * 20, "same"),  # sure, but not large
        ([0.5, 2.0] * 10, "same"),  # large, but not sure
        ([3.0] * 7, "same"),  # 7 of 7 happen by chance in 1.6 % of all cases: not 99 % sure
        ([3.0] * 8, "worse"),
        ([0.5] * 20, "better"),
    ],
)
def test_a_timing_is_worse_only_if_it_is_sure_and_large(ratios: list[float], verdict: str):
    assert timing(sorted(ratios), median(ratios)).verdict == verdict


def test_a_machine_that_is_busy_in_all_rounds_but_one_does_not_make_an_engine_slower():
    assert timing([1.0] + [3.0] * 19, 1.0).verdict == "same"
    assert timing([1.0] + [3.0] * 19, 1.5).verdict == "worse"


def test_the_interval_holds_the_true_median_as_often_as_it_says():
    draw = random.Random(1)
    found = [
        timing(sorted(draw.expovariate(0.6931471805599453) for _ in range(20)), 1.0)
        for _ in range(2000)
    ]

    assert isinstance(found[0], Timing)
    assert sum(one.low <= 1 <= one.high for one in found) / 2000 > 0.985


def test_a_scene_that_is_not_judged_any_more_is_worse(before: Path, after: Path):
    table = pd.read_csv(after / "deviations.csv", dtype=str, keep_default_na=False)
    judged = table[(table.scenario != "slow_collision") | (table.versus != "truth")]
    runs = table[table.scenario == "slow_collision"].drop_duplicates(["engine", "profile", "dt_s"])
    why = "not judged: the exact answer took longer than 60 s (--timeout)"
    lost = runs.assign(metric="status", value="", unit="", versus="truth", at_s="", note=why)
    put_table(pd.concat([judged, lost]), after)
    changes = [difference(*folders).changes for folders in ((before, after), (after, before))]
    worse, better = (
        set(x[["before", "after", "verdict"]].itertuples(index=False)) for x in changes
    )

    assert [*map(len, changes)] == [len(runs)] * 2 != [0, 0]
    assert (worse, better) == ({("judged", why, "worse")}, {(why, "judged", "better")})
    assert exit_of(before, after) == 1


def test_a_run_without_tables_is_one_sentence(before: Path, after: Path):
    with writing(after, COMMAND) as store:
        store.rows.delete("run", "table")

    with pytest.raises(Unusable, match="make them: crosscheck report"):
        difference(before, after)
