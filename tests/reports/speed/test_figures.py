"""The kept tables are those of this code, and the documents' statements on speed follow from them,
engine by engine."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from crosscheck2d.adapters.engines import DISTINCT, ENGINES
from crosscheck2d.adapters.mechanisms.table import MECHANISMS
from crosscheck2d.reports.compare.accuracy import YARDSTICK
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.speed import budget, figures, ladder, tables
from crosscheck2d.reports.speed.budget import budget_of
from crosscheck2d.reports.speed.measure import Measured
from crosscheck2d.reports.speed.plan import FULL, QUICK, SCENE, middle
from crosscheck2d.reports.speed.tables import COMPARED
from crosscheck2d.scenarios.catalogue import SCENARIOS, scenario
from tests.measured import MEASURED
from tests.reports.speed import statements as speed_figures
from tests.reports.speed.statements import MATCHED, SHIPPED

ROOT = Path(__file__).parents[3]
FRONT = (ROOT / "README.md").read_text("utf-8")
SPEED = (ROOT / "reports" / "speed" / "README.md").read_text("utf-8")
WITH_MECHANISMS = [name for name in MECHANISMS if name in ENGINES and name in MEASURED]
DIGITS = 2e-3  # four digits are kept


def kept_row(path: object, scene: str, name: str) -> pd.Series:
    table = speed_figures.named(figures.read(path))  # type: ignore[arg-type]
    return table[(table.scenario == scene) & (table.name == name)].iloc[0]


@pytest.mark.parametrize("name", [name for name in DISTINCT if name in MEASURED])
def test_the_kept_orders_are_those_of_the_code(name: str):
    scene = "head_on_unequal_e09"
    step_sizes = FULL.ladder(open_scene(scene, 0))
    rows = ladder.errors_of(scene, 0, name, ENGINES[name].make, step_sizes)
    now = tables.orders(Measured(errors=pd.DataFrame(rows).assign(kind=SCENE)), 0).iloc[0]
    kept = kept_row(figures.ORDERS, scene, name)

    assert kept.verdict == now.verdict
    for end in ("coarsest_error", "finest_error"):
        # below: rounding of another machine
        assert kept[end] == pytest.approx(now[end], rel=DIGITS, abs=1e-9)
    if now.finest_error > 1e-9:
        assert kept.slope == pytest.approx(now.slope, rel=DIGITS, nan_ok=True)


@pytest.mark.parametrize("name", WITH_MECHANISMS)
def test_the_kept_budget_is_that_of_the_code(name: str):
    scene = "slow_collision"
    rows = pd.DataFrame(budget_of(scene, 0, name, middle(scene)), columns=budget.COLUMNS)
    now, kept = budget.explain(rows).iloc[0], kept_row(figures.EXPLAINED, scene, name)

    assert kept.error_radii == pytest.approx(now.error_radii, rel=DIGITS)
    assert kept.residual_radii == pytest.approx(
        now.residual_radii, rel=0.1, abs=1e-5 * now.error_radii
    )
    assert (kept.until_s, kept.horizon_s, kept.duration_s) == pytest.approx(
        (now.until_s, now.horizon_s, now.duration_s), rel=DIGITS
    )


def test_the_kept_tables_have_every_scene_and_measured_engine():
    orders, budgets = (
        speed_figures.named(figures.read(path)) for path in (figures.ORDERS, figures.EXPLAINED)
    )

    scenes = set(SCENARIOS)
    assert set(zip(orders.scenario, orders.name)) == {
        (scene, name) for scene in scenes for name in DISTINCT if name in MEASURED
    }
    assert set(zip(budgets.scenario, budgets.name)) == {
        (scene, name) for scene in scenes for name in WITH_MECHANISMS
    }


def orders(**stays: int) -> pd.DataFrame:
    """Two scenes; an engine's shipped profile comes no nearer in so many."""
    rows = []
    for name in ENGINES:
        engine, profile = name.split(":")
        for k in range(2):
            error = 0.95 if name in SHIPPED and k < stays.get(engine, 0) else 0.8
            rows.append((f"scene {k}", engine, profile, 1.0, error, 0, 4))
    columns = ["scenario", "engine", "profile", "coarsest_error", "finest_error", "failed", "steps"]
    return pd.DataFrame(rows, columns=columns)


def test_the_sentence_on_finer_steps_counts_each_engine():
    sentence, *lines = speed_figures.nearer(orders(box2d=1, box2d_v3=2)).splitlines()

    assert sentence.startswith(
        "In how many of 2 scenes the error falls by less than a tenth from the coarsest to the"
        " finest step, "
    )
    cells = [line.strip("| ").split(" | ") for line in lines if line.startswith("| ")]
    counts = {name: count for name, count in cells if count.isdigit()}
    assert counts["box2d:matched"] == "0"
    nonzero = {name: count for name, count in counts.items() if count != "0"}
    assert nonzero == {"box2d:shipped": "1", "box2d_v3:shipped": "2"}
    assert speed_figures.nearer(orders(pymunk=1)) != speed_figures.nearer(orders(box2d=1))


def test_no_nearer_is_read_from_the_ends_of_the_ladder():
    # A tenth less is nearer; a finest step that fails or is no better is not; nor count rounding
    # and all failed.
    rows = [(1.0, 0.89, 0), (1.0, 0.91, 0), (1.0, np.inf, 1)]
    rows += [(np.inf, np.inf, 4), (1e-14, 2e-14, 0), (np.inf, 1.0, 1)]
    columns = ["coarsest_error", "finest_error", "failed"]
    table = pd.DataFrame(rows, columns=columns).assign(steps=4)

    assert speed_figures.no_nearer(table).tolist() == [False, True, True, False, False, False]


def row(figure: str, name: str, at: str, value: float, note: str = "") -> dict:
    who = dict(zip(("engine", "profile"), name.split(":")))
    return who | {"figure": figure, "at": at, "value": value, "note": note}


def against(cheaper: dict[str, str], bare: dict[str, str], changed: str = "") -> pd.DataFrame:
    """Figures of two scenes in which these engines cost less than our own solver, in "k of 2:
    scenes"."""
    rows = [row(figures.AGAINST, "pymunk:matched", "sleeping", 2.0, changed or "0 of 1: ")]
    for name in COMPARED:
        rows.append(row(figures.AGAINST, name, "", 2.0, cheaper.get(name, "0 of 2: ")))
        rows.append(row(figures.AGAINST_BARE, name, "", np.nan, bare.get(name, "0 of 2: ")))
    return pd.DataFrame(rows)


def test_who_costs_less_than_our_own_solver_is_named():
    alone = speed_figures.costs(against({}, {}))
    thrust = {"pymunk:matched": "1 of 2: ship_thrust"}

    assert (
        alone == f"Of the engines with end-of-step detection, `{YARDSTICK}` costs least in 2 of 2"
        " scenes.\n\n"
        "None of 1 changed settings of the matched engines costs less in any scene tried.\n"
    )
    said = speed_figures.costs(against(thrust, thrust))
    assert "costs least in 1 of 2 scenes. In the others these cost less:" in said
    assert "| ship_thrust | pymunk:matched |" in said
    assert "idle step" not in said
    other = speed_figures.costs(against({"box2d:matched": "1 of 2: free_fall"}, thrust))
    assert "| free_fall | box2d:matched |" in other
    assert (
        "If the cost of an idle step is subtracted, some engine costs less in 1 scene: ship_thrust."
        in other
    )
    changed = speed_figures.costs(against({}, {}, "1 of 1: free_fall"))
    assert changed.endswith(
        "With one setting changed, these cost less in free_fall: pymunk:matched with sleeping.\n"
    )


def pooled(worse: str = "") -> pd.DataFrame:
    """Figures of three steps: every error is halved, every cost doubled; one engine is three times
    as far off."""
    rows = []
    for name in ENGINES:
        lost = f"failed in {int(name == 'event_driven:float64')} of 2"
        for k in range(3):
            error = 0.1 * (3.0 if name == worse else 1.0) / 2**k
            rows.append(row("pooled error", name, str(k), error, lost))
            rows.append(row("pooled cost", name, str(k), 2.0**k))
        reached = "0 of 2, never in 2" if name in COMPARED else "1 of 2"
        rows.append(row("cost at accuracy", name, "1e-6", 1.0, reached))
    return pd.DataFrame(rows)


def test_sentences_on_pooled_figures_hold_for_the_worst_engine_and_count_scenes_and_failures():
    for name in MATCHED:
        assert "are 1.0 to 3.0 times as far" in speed_figures.as_far(pooled(name))
    caption = speed_figures.caption(pooled())
    assert "multiplies the time of these engines by 2.0 to 2.0, and divides" in caption
    assert "by 2.0 to 2.0 for `reference:lesson`, by 2.0 to 2.0 for the engines as" in caption
    assert "exact answer in 0 to 1 of 2 scenes" in caption
    assert "in 1 (`reference:ordered`) and 1 (event-driven; it fails in 1)." in caption


def test_the_readme_says_how_much_each_form_measures():
    text = " ".join(SPEED.split())

    assert f"the cost of up to {QUICK.sizes[-1]:,} disks".replace(",", " ") in text
    assert f"`--full` takes all scenes and up to {FULL.sizes[-1]:,} disks".replace(",", " ") in text
    assert set(FULL.scenes) == set(SCENARIOS)
    assert {len(scenario(name).substeps) for name in SCENARIOS} == {4}
    assert "at 4 step sizes" in FRONT


@pytest.mark.parametrize(
    ("name", "fails"), [("reference:exercise", True), ("box2d:matched", False)]
)
def test_what_fails_a_verdict_is_infinitely_far_off(name: str, fails: bool):
    # A disk of 100 kg falls through one of 1 kg and the floor.
    scene = str(ROOT / "tests" / "data" / "scenes" / "heavy_on_light.toml")
    (row,) = ladder.errors_of(scene, 0, name, ENGINES[name].make, [4])
    assert (row["status"], np.isinf(row["error_radii"])) == ("fails" if fails else "ok", fails)
    assert row["until_s"] == 3


def test_the_caption_of_the_picture_follows_from_the_kept_table():
    text = " ".join(SPEED.split())

    assert speed_figures.caption(figures.read(figures.KEPT)) in text
    assert "the geometric mean over the scenes, without the best and the worst quarter" in text


def test_what_half_a_step_buys_is_said_of_every_engine_with_end_of_step_detection():
    # The ranges of the caption are those of all engines that it speaks of, and none is left out.
    late = {YARDSTICK, *COMPARED}
    spoken_of = [name for names in speed_figures.LATE_BY_KIND.values() for name in names]
    assert sorted(spoken_of) == sorted(late)
    ordered = {"reference:ordered", "event_driven:float64"}
    assert late & MEASURED == (set(DISTINCT) & MEASURED) - ordered


def test_the_scenes_in_which_smaller_steps_do_not_help_are_counted_for_every_engine():
    table = SPEED.split("falls by less than a tenth")[1]

    assert [name for name in DISTINCT if name in MEASURED and f"\n| {name} | " not in table] == []


def test_the_page_on_speed_ends_with_what_follows_from_the_kept_tables():
    assert SPEED.endswith(f"less there.\n\n{speed_figures.measured()}")


def test_nothing_else_is_said_of_who_costs_least():
    assert (FRONT + SPEED).count("costs least") == 1
