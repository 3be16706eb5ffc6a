"""`crosscheck stability`: its files, its page, what it says of bad input, and what a second run
keeps."""

from __future__ import annotations

import inspect
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from playwright.sync_api import Browser, Page

from crosscheck2d.adapters.engines import ENGINES, read_row
from crosscheck2d.adapters.host.engine import TEMPLATES
from crosscheck2d.reports import cli
from crosscheck2d.reports.page.kit import PAGES
from crosscheck2d.reports.run.store import reading, writing
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.command import COLUMNS, STABILITY, write_files
from crosscheck2d.reports.stability.limits import DRIVEN_ENGINES, QUICK, LimitSearch, taking_part
from crosscheck2d.reports.stability.results import (
    StabilityPlan,
    Task,
    expected,
    read_results,
)
from crosscheck2d.reports.stability.tables import MAPS
from tests.reports.page.browsing import opened
from tests.reports.terminal.command_line import crosscheck

pytestmark = pytest.mark.slow  # measures, and draws what it measured, for half a minute

ROOT = Path(__file__).parents[3]
ASKED = (
    "slow_collision",
    "tunnelling_thin_wall",
    "scenes/two.toml",
    "dt_and_speed",
    "touching_break",
)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("results") / "out"
    engines = ("--engine", "box2d:shipped", "--engine", "pymunk:matched")
    done = crosscheck(
        "stability", *ASKED, "--vary", "speed", *engines, "--out", out, cwd=ROOT / "tests" / "data"
    )
    assert done.returncode == 0, done.stderr
    assert "stability.html" in done.stdout
    return out


def test_the_table_of_limits_is_a_file(results: Path):
    table = pd.read_csv(results / "limits.csv")
    row = table[(table.case == "slow_collision") & (table.engine == "box2d")].iloc[0]
    runs = CASES["slow_collision"].runs

    assert list(table.columns) == list(COLUMNS)
    assert set(table.case) == {"slow_collision", "tunnelling_thin_wall", "scenes/two.toml:speed"}
    assert row.fails_at < 1.0 < row.works_at
    assert (row.unit, row.predicate, row.seeds) == ("m/s", "restitution off", runs)
    assert set(pd.read_csv(results / "maps.csv")["map"]) == {"dt_and_speed"}


def test_the_first_failing_run_is_kept(results: Path):
    with reading(results, STABILITY) as store:
        limits = read_results(store).limits
    replays = {limit.engine: limit.replay for limit in limits if limit.case == "slow_collision"}

    assert replays["box2d:shipped"] != ""
    assert replays["pymunk:matched"] == ""


def test_what_a_run_takes_is_said_before_it(tmp_path: Path):
    plan = StabilityPlan([*CASES, *MAPS], ["pymunk:matched"], "quick")
    quick, full = (replace(plan, form=form).tasks() for form in ("quick", "full"))
    minutes = [
        int(re.search(r"(\d+) minute", expected(tasks, workers))[1])
        for tasks, workers in ((quick, 1), (full, 1), (full, 2))
    ]
    done = crosscheck("stability", "spin", "--engine", "pymunk", cwd=tmp_path)

    assert expected(quick, 1).startswith(f"{len(quick) - 3} searches ({len(CASES)} cases, ")
    assert minutes[1] > 2 * minutes[0]
    assert minutes[2] < minutes[1]
    assert "2 searches (1 case, 2 engines): about 1 minute in" in done.stderr


def test_the_same_rows_give_the_same_files(
    results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(ROOT / "tests" / "data")
    again = tmp_path / "again"
    shutil.copytree(results, again)
    (again / "limits.csv").unlink()
    with writing(again, STABILITY) as store:
        write_files(store)

    assert (again / "limits.csv").read_bytes() == (results / "limits.csv").read_bytes()


def test_a_task_has_another_key_where_anything_that_decides_it_is_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    plan = StabilityPlan(["slow_collision"], ["box2d:shipped"], "quick")
    tasks = [
        Task(name, "box2d:shipped", form)
        for name in ("slow_collision", "two.toml:speed")
        for form in ("quick", "full")
    ]
    keys = set()
    for text in ("first", "second"):
        Path("two.toml").write_text(text)
        keys |= {plan.key(task) for task in tasks}
    assert len(keys) == 6

    monkeypatch.setattr(StabilityPlan, "versions", {"pymunk": "6"})
    assert not keys & {plan.key(task) for task in tasks}


def test_what_has_a_row_is_not_played_again(
    results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(Task, "run", None)  # nothing can be played
    shutil.copytree(results, tmp_path / "out")
    words = ("slow_collision", "--engine", "pymunk:matched", "--engine", "box2d:shipped")
    done = crosscheck("stability", *words, "--out", "out", cwd=tmp_path)

    assert done.returncode == 0, done.stderr
    assert set(pd.read_csv(tmp_path / "out" / "limits.csv").case) == {"slow_collision"}


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["slow_collisions"], "case 'slow_collisions' is not known; did you mean slow_collision"),
        (
            ["scenes/two.toml", "--vary", "mass"],
            "--vary 'mass' is not known; did you mean mass_ratio?; allowed: dt, speed, mass_ratio,"
            " restitution, scale, offset",
        ),
        (["--vary", "dt"], "--vary dt: varies a scene file, and none is named; name FILE.toml"),
        (["nowhere.toml"], "nowhere.toml: no such file or directory"),
        (["--engine", "bullet"], "engine 'bullet' is not known"),
        (
            ["slow_collision", "--engine", "../solvers/correct/plain.py"],
            "it does not test a solver of the exercise: crosscheck check",
        ),
        (
            ["scenes/still.toml", "--vary", "mass_ratio"],
            "still.toml: --vary mass_ratio: no disk moves",
        ),
        (
            ["scenes/still.toml", "--vary", "dt"],
            "still.toml: --vary dt: it lasts less than ten steps of an eighth",
        ),
    ],
)
def test_bad_input_is_one_clear_sentence(words: list[str], says: str):
    done = crosscheck("stability", *words, cwd=ROOT / "tests" / "data")

    assert done.returncode == 2
    assert says in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.fixture(scope="module", params=[1280, 400])
def page(request: pytest.FixtureRequest, browser: Browser, results: Path):
    uri, size = (results / "stability.html").as_uri(), {"width": request.param, "height": 900}
    page, faults = opened(browser, uri, viewport=size, offline=True)
    yield page
    page.context.close()
    assert faults == []


def test_a_failure_is_two_clicks_away_and_opens_just_before_it(page: Page):
    page.locator("#tunnelling_thin_wall button.open").click()
    page.locator(".opened summary", has_text="pymunk:matched").click()
    player = "Object.values(players).find((p) => p.pack.layers[0].name === 'pymunk:matched')"
    page.wait_for_function(f"() => window.players && {player}")
    opens, event, end = page.evaluate(
        f"() => {{ const p = {player}; return [p.time, p.pack.event.t, p.until]; }}"
    )

    assert opens < event <= end
    assert "the collision is missed" in page.locator(".opened summary").first.inner_text()
    # in one call: a replay that plays begins anew from its end
    truth, played = page.evaluate(
        f"() => {{ const p = {player}; p.seek(p.until);"
        " return ['truth', 'pymunk:matched'].map((name) => p.positions(name)[0][0]); }"
    )
    assert truth < 0 < played  # it is on the wrong side of the wall


def test_the_page_fits_and_needs_nothing_from_anywhere(page: Page, results: Path):
    page.locator("[id='box2d:shipped'] button.open").click()
    page.wait_for_selector("#maps .opened")
    width, inner = page.evaluate("() => [document.documentElement.scrollWidth, innerWidth]")
    html = (results / "stability.html").read_text()

    assert width <= inner
    assert len(html) < 2e6
    assert not re.search(r"(?:src|href)=\"https?:", html)
    one = MAPS["dt_and_speed"]
    assert page.locator("#maps .opened td td").count() == len(one.x) * len(one.y)
    row = page.locator("#slow_collision .note")
    assert row.inner_text() == "closing speed, m/s; dt 15.6 ms, R 0.25 m"
    cells = page.locator("#slow_collision td").all_inner_texts()
    assert cells == ["–", "0.993"]
    clear = "(cell) => getComputedStyle(cell).backgroundColor === 'rgba(0, 0, 0, 0)'"
    shown = [cell.evaluate(clear) for cell in page.locator("#slow_collision td").all()]
    assert shown == [True, False]  # what fails has a colour, of a class of the kit


def test_the_page_says_what_its_counts_count(page: Page):
    counts = page.locator(".lead").last.inner_text()

    assert "Each profile of an engine counts as one engine." in counts
    assert "This page has 2 engines" in counts
    assert f"{len(page.locator('#limits tr.opens').all())} cases" in counts


def test_the_stability_page_and_the_report_point_at_each_other_where_they_are_made(results: Path):
    report, limits = (
        Path("reports/out/latest/report.html"),
        Path("reports/out/stability/stability.html"),
    )
    defaults = [
        inspect.signature(run).parameters["out"].default for run in (cli.run, cli.stability)
    ]
    assert defaults == [report.parent, limits.parent]
    assert PAGES["report"].href == "latest/report.html"
    assert PAGES["stability"].href == "stability/stability.html"
    assert not (results.parent / "latest").exists()
    assert 'href="../' not in (results / "stability.html").read_text()  # none that leads nowhere


def with_threshold(folder: Path) -> Path:
    text = TEMPLATES["javascript"].read_text()
    right = "const impulse = -(1 + world.e)"
    assert right in text
    path = folder / "slow.js"
    path.write_text(text.replace(right, "const impulse = -(1 + world.e * Math.min(1, -closing))"))
    return path


@pytest.mark.slow
def test_an_engine_in_a_file_takes_part(tmp_path: Path):
    name = f"{with_threshold(tmp_path)}:own"
    with taking_part({name: read_row(name)}):
        search = LimitSearch(CASES["slow_collision"], name, QUICK)
        works = [search.trial(value, 2).works for value in (2.0, 0.5)]

    assert works == [True, False]
    assert name not in ENGINES
    assert name not in DRIVEN_ENGINES


@pytest.mark.long
def test_an_engine_in_a_file_is_driven_to_its_limit(tmp_path: Path):
    with_threshold(tmp_path)
    words = ("slow_collision", "--engine", "slow.js", "--out", "limits")
    done = crosscheck("stability", *words, cwd=tmp_path)
    [limit] = pd.read_csv(tmp_path / "limits" / "limits.csv").itertuples()
    again = crosscheck("stability", *words, cwd=tmp_path)

    assert done.returncode == again.returncode == 0, done.stderr + again.stderr
    assert limit.fails_at < 1 <= limit.works_at * 1.05  # the bracket's width
