"""A law of `reports/compare/laws.py` is worked out once for the same objects, and forgotten with
them."""

import gc
import weakref
from dataclasses import replace

import pytest

from crosscheck2d.reports.compare.laws import cached
from crosscheck2d.scenarios.catalogue import scenario
from crosscheck2d.scenarios.model import Scene


@pytest.fixture
def asked() -> list[tuple[Scene, Scene]]:
    return []


def test_the_same_objects_are_asked_once_and_others_that_look_alike_again(asked: list):
    law = cached(lambda one, other: asked.append((one, other)) or one.position + other.position)
    one, other = (scenario(name).scene for name in ("near_miss", "oblique_e1"))
    again = replace(other)

    found = law(one, other)
    assert law(one, other) is found
    assert law(one, again) is not found
    assert asked == [(one, other), (one, again)]


def test_what_was_found_cannot_be_edited():
    found = cached(lambda scene: scene.position * 2)(scenario("near_miss").scene)

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
