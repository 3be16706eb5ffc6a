"""A page of three real scenes on three real engines, with hostile text where text can come from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from crosscheck2d.adapters.engines import ENGINES
from crosscheck2d.adapters.play import play
from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.compare.comparison import Comparison, compare
from crosscheck2d.reports.page.report import report_page
from crosscheck2d.reports.page.summary import summarize
from crosscheck2d.scenarios.catalogue import scenario

HOSTILE = (
    "</script><script>window.hacked = 1</script><img src=x onerror='window.hacked = 2'>{{ 7 * 7 }}"
)
LONG = "a_name_without_a_place_to_break_it_" * 6
PLAYED = ("reference:exercise", "pymunk:matched", "box2d:shipped")
HEAD_ON, ORBIT, ASTEROIDS = "head_on_equal_e09", "disk_between_static_disks", "asteroids"


def played(name: str, **changes: Any) -> Comparison:
    """A real scenario on three real engines, with one that crashed and one that refused, both
    saying hostile things."""
    scene = replace(scenario(name), **changes)
    steps = scene.substeps[1:3]
    scene = replace(scene, substeps=steps)
    runs = [play(ENGINES[key].make(), key, scene, scene.dt(k)) for key in PLAYED for k in steps]
    failed = [
        ("box2d_v3", "shipped", "crashed", HOSTILE),
        ("box2d_v3", "matched", "unsupported", f"no {LONG}"),
    ]
    runs += [
        Run(e, p, name, scene.dt(k), status, why) for e, p, status, why in failed for k in steps
    ]
    return compare(scene, runs)


def write_small(path: Path, comparisons: list[Comparison], **more: Any) -> None:
    probe = {"engine": "pymunk", "profile": "matched", "probe": HOSTILE, "asked": HOSTILE}
    probe |= {"got": 0.81, "expected": 0.9, "bound": 1e-6, "verdict": "departs", "note": HOSTILE}
    known = {"column": "ODE", "dt_s": 1e-3, "published_J2": 185.027, "ours_J2": 185.027}
    known |= {"made_by": "reference:exercise", "source": HOSTILE}
    about = {"command": f"crosscheck --out '{HOSTILE}'", "seed": 0, "machine": {"system": HOSTILE}}
    about |= {"seconds": 1.0, "unfinished": "", "versions": {"pymunk": "7.3.1"}}
    about["started"] = "2026-01-01T00:00:00+00:00"
    page = report_page(
        path,
        summarize(comparisons),
        conformance=pd.DataFrame([probe]),
        known_answers=[known],
        about=about,
        **{"first": ["One.", HOSTILE, "Three."], **more},
    )
    path.write_text(page, encoding="utf-8")
