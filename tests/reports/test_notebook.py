"""`import crosscheck2d`: its five functions, and what they show in a notebook."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import nbformat
import numpy as np
import pandas as pd
import pytest
from nbclient import NotebookClient
from playwright.sync_api import Browser

import crosscheck2d
from crosscheck2d.reports import notebook
from crosscheck2d.reports.check.rows import TASKS
from crosscheck2d.scenarios.model import Scenario, Trajectory
from tests.reports.page.browsing import opened
from tests.solvers.mutants import CORRECT

NOTEBOOK = Path(notebook.__file__).with_suffix(".ipynb")
DISK = {"radius": 0.25, "mass": 1.0}
TABLE = {
    "name": "pair",
    "duration": 1.0,
    "sample_interval": 0.1,
    "restitution": 0.9,
    "disk": [
        DISK | {"position": [-1.0, 0.0], "velocity": [2.0, 0.0]},
        DISK | {"position": [1.0, 0.0], "velocity": [0.0, 0.0]},
    ],
}
# A disk that meets two at once: from the start on there is no answer.
AT_ONCE = [DISK | {"position": [0.0, y], "velocity": [0.0, 0.0]} for y in (0.25, -0.25)]
MEETS = [DISK | {"position": [-(0.1875**0.5), 0.0], "velocity": [1.0, 0.0]}]
THREE = TABLE | {"disk": MEETS + AT_ONCE}
NO_ORDER = "the outcome depends on the order of their collisions"


def test_the_import_is_quick():
    """Nothing of the libraries is imported before a function is used."""
    code = (
        "import sys; before = set(sys.modules); import crosscheck2d; print(dir(crosscheck2d),"
        " sorted({*sys.modules} - before))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == f"{crosscheck2d.__all__} ['crosscheck2d']"
    with pytest.raises(AttributeError, match="module 'crosscheck2d' has no attribute 'jump'"):
        crosscheck2d.jump  # noqa: B018


def test_a_scene_is_opened_by_name_from_a_file_or_from_its_keys(tmp_path: Path):
    """The same keys as in a file, and the same faults, a line each."""
    file = tmp_path / "pair.toml"
    pair = crosscheck2d.scene(**TABLE)
    file.write_text(notebook.scene_text(pair))
    again = crosscheck2d.scene(file)

    assert isinstance(pair, Scenario)
    assert np.array_equal(again.scene.position, pair.scene.position)
    assert crosscheck2d.scene("slow_collision").name == "slow_collision"
    assert "<svg" in pair._repr_html_().replace("&lt;", "<")
    with pytest.raises(ValueError, match=r"slow_colision.*did you mean slow_collision"):
        crosscheck2d.scene("slow_colision")
    with pytest.raises(ValueError, match=r"slow_collision is a whole scene: .* restitution"):
        crosscheck2d.scene("slow_collision", restitution=0.5)
    with pytest.raises(ValueError, match=r"radius = 0.*\n.*mass = -1"):
        crosscheck2d.scene(**TABLE | {"disk": [TABLE["disk"][0] | {"mass": -1, "radius": 0}]})


def test_the_exact_answer_is_a_trajectory_or_the_reason_why_there_is_none():
    """0.75 s: the disks, 1.5 m apart, touch."""
    answer = crosscheck2d.truth(crosscheck2d.scene(**TABLE))
    assert isinstance(answer, Trajectory)
    assert answer.collisions.t == pytest.approx([0.75])
    assert "Exact up to 1 s." in answer._repr_html_()
    with pytest.raises(ValueError, match=NO_ORDER):
        crosscheck2d.truth(crosscheck2d.scene(**THREE))


def test_runs_are_rows_of_numbers_in_workers():
    """As in deviations.csv; what is taken from it is a plain frame; a refusal is a row."""
    pair = crosscheck2d.scene(**TABLE)
    other = crosscheck2d.scene(**TABLE | {"name": "rough", "friction": 0.3})
    runs = crosscheck2d.run([pair, other], ["pymunk:matched", "event_driven"], [0.05, 0.1])
    scores = runs[(runs.metric == "position_max_radii") & (runs.scenario == "pair")]

    assert type(scores) is pd.DataFrame
    assert set(scores.dt_s) == {0.05, 0.1}
    assert scores[scores.engine == "event_driven"].value.max() < 1e-9
    assert set(runs.scenario) == {"pair", "rough"}
    with pytest.raises(ValueError, match="boxed2d"):
        crosscheck2d.run(pair, "boxed2d")
    with pytest.raises(ValueError, match=r"0\.03 does not fit"):
        crosscheck2d.run(pair, "pymunk", 0.03)


def test_an_engine_that_kills_its_process_is_a_row(tmp_path: Path):
    """And the notebook lives on."""
    file = tmp_path / "engine.py"
    file.write_text(
        "import os\nmodels = 'gravity walls'\ndef create(scene, dt): return {}\n"
        "def step(world, dt): os._exit(3)\ndef read(world): return {}\n"
    )
    runs = crosscheck2d.run(crosscheck2d.scene(**TABLE), str(file), 0.1)
    assert set(runs.metric) == {"status"}


def test_a_check_has_a_row_for_each_question(tmp_path: Path):
    """No fault in a right file; one sentence for what is none."""
    right = next(path for path in CORRECT if path.name == "plain.js")
    found = crosscheck2d.check(right)
    assert set(found.verdict) <= {"right", "free choice", "not asked"}
    assert set(found.task) <= {*TASKS}
    with pytest.raises(ValueError, match=r"none\.js: No such file"):
        crosscheck2d.check(tmp_path / "none.js")


@pytest.mark.slow
def test_advice_names_the_cheapest_first():
    """Of a scene that is in no file."""
    advice = crosscheck2d.advise(crosscheck2d.scene(**TABLE), 0.1, engines="event_driven")
    assert advice.engine.tolist() == ["event_driven:float64"]
    assert advice.error[0] < 1e-9
    assert advice.us_per_simulated_s[0] > 0
    with pytest.raises(ValueError, match="must be one of trajectory"):
        crosscheck2d.advise("free_fall", purpose="fun")
    with pytest.raises(ValueError, match="no exact answer"):
        crosscheck2d.advise(crosscheck2d.scene(**THREE))


def test_what_a_cell_shows_is_drawn_in_a_browser(browser: Browser, tmp_path: Path):
    """A frame in the page, as high as what it holds; nothing is asked of outside."""
    runs = crosscheck2d.run(crosscheck2d.scene(**TABLE), ["pymunk:matched"], [0.1, 0.05])
    (tmp_path / "cell.html").write_text(f"<!doctype html>{runs._repr_html_()}", "utf-8")
    page, heard = opened(browser, (tmp_path / "cell.html").as_uri())
    frame = page.frame_locator("iframe")
    frame.locator("canvas").first.wait_for()
    text, charts = frame.locator("body").inner_text(), frame.locator("figure svg").count()
    height = page.locator("iframe").evaluate("frame => frame.clientHeight")
    page.context.close()

    assert heard == []
    assert "pymunk:matched" in text
    assert charts == 1
    assert height > 500


@pytest.mark.slow
def test_the_notebook_runs_and_every_cell_shows_something():
    """From top to bottom in a kernel of its own; it is kept without outputs."""
    book = nbformat.read(NOTEBOOK, as_version=4)
    cells = [cell for cell in book.cells if cell.cell_type == "code"]
    assert all(not cell.outputs and cell.execution_count is None for cell in cells)
    assert len(json.dumps(book)) < 5000
    NotebookClient(book, timeout=300).execute()
    shown = [[out.data for out in cell.outputs if "data" in out] for cell in cells]

    assert all(any("text/html" in data for data in outputs) for outputs in shown)
    assert ["<iframe" in str(outputs) for outputs in shown] == [True, True, True, False, False]


def test_bad_arguments_are_one_sentence():
    scene = crosscheck2d.scene("head_on_equal_e09")
    calls: dict[str, Callable[[], object]] = {
        r"scenes=\[\]: name at least one": lambda: crosscheck2d.run([], ["pymunk"]),
        "must be a number of s": lambda: crosscheck2d.run(scene, "pymunk", dts=[0]),
        "such as 0.01 for 1 %": lambda: crosscheck2d.advise(scene, error="1%"),  # type: ignore[arg-type]
        "is a folder; for a class": lambda: crosscheck2d.check(Path()),
    }
    for says, call in calls.items():
        with pytest.raises(ValueError, match=says):
            call()
