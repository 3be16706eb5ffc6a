"""What the page of limits says beside its numbers: what a case keeps."""

from __future__ import annotations

import pytest

from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.stability.cases import CASES
from crosscheck2d.reports.stability.limits import LIMIT, Case, Limit, Trial
from crosscheck2d.reports.stability.overview import findings, held, in_words


def played_with(case: Case, value: float) -> tuple[str, set[str]]:
    one = case.scene(value, 0)
    radii = one.scene.radius[~one.scene.static]
    return f"{number(1e3 * one.dt(one.substeps[0]))} ms", {number(r) for r in radii}


@pytest.mark.parametrize(("broken", "words"), [("refused", "refused from 3"), ("escape", "3")])
def test_a_refusal_is_no_limit(broken: str, words: str):
    trial = Trial(3.0, 1, 1, 1.0, event="it is cut", broken=broken)
    limit = Limit("spin", "box2d:matched", "quick", LIMIT, 1.0, 3.0, (trial,))
    limits, refused = (0, 1) if broken == "refused" else (1, 0)

    assert in_words(limit) == words
    assert f"{limits} found a limit" in findings([limit])[0]
    assert f"in {refused} the engine refused" in findings([limit])[0]


@pytest.mark.parametrize("name", ["slow_collision", "column", "tunnelling_thick_wall", "spin"])
def test_what_a_case_keeps_is_that_of_every_run(name: str):
    case = CASES[name]
    kept = held(case)

    for value in case.values:
        dt, radii = played_with(case, value)
        assert kept == {"dt": dt, "R": f"{min(radii)} m"}
        assert len(radii) == 1


def test_what_a_case_varies_is_not_said_to_be_kept():
    assert held(CASES["bounce_drift"]) == {"R": "0.25 m"}
    assert list(held(CASES["scale_down"])) == ["dt"]
    assert held(CASES["dt_galperin_314"]) == {"R": "0.25 to 0.5 m"}
