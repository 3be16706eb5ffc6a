"""Each scene names the cheapest model that answers it, and the harness takes that one for its
truth."""

from __future__ import annotations

import pytest

from crosscheck2d.scenarios.catalogue import SCENARIOS, scenario
from crosscheck2d.scenarios.truth import exact as oracle
from crosscheck2d.scenarios.truth.exact import (
    CLOSED_FORM,
    EVENT_DRIVEN,
    NOTHING,
    answered_by,
)

MODELS = {name: answered_by(scenario(name)) for name in SCENARIOS}


def never(*_: object) -> None:
    raise AssertionError("computed by events")


@pytest.mark.parametrize("name", [name for name, model in MODELS.items() if model == CLOSED_FORM])
def test_a_scene_that_names_a_closed_form_is_answered_without_following_a_collision(
    name: str, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(oracle, "computed", never)
    monkeypatch.setattr(oracle, "look_up", never)
    one = scenario(name)

    assert one.truth is not None
    assert len(one.truth(one.times)) >= 2


def test_a_scene_that_is_computed_by_events_says_so(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(oracle, "look_up", never)
    by_events = [name for name, model in MODELS.items() if model == EVENT_DRIVEN]

    assert {"asteroids", "gas_of_100", "cradle_touching"} <= set(by_events)
    for name in by_events:
        one = scenario(name)
        assert one.truth is not None
        with pytest.raises(AssertionError, match="computed by events"):
            one.truth(one.times)


def test_every_scene_names_a_model():
    assert NOTHING not in MODELS.values()
