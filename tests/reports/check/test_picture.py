"""The picture of a smallest scene: a PNG that PrairieLearn shows."""

from __future__ import annotations

import json
from base64 import b64decode
from dataclasses import replace
from functools import cache
from io import BytesIO

import jsonschema
import numpy as np
import pytest
from PIL import Image

from reports.check.formats import prairielearn
from reports.check.formats.formats import FORMATS
from reports.check.formats.prairielearn import LARGEST, LONGEST
from reports.check.picture import FARTHEST, RIGHT, START, YOURS, data_url, drawn, label, png
from reports.check.smallest import Smallest, scenario_of
from scenarios.model import Array, Trajectory
from tests.reports.check.test_marks import marked, row, schema_of


@cache
def smallest() -> Smallest:
    """A head-on pair; `yours` stays where it is."""
    scenario = scenario_of([(-1, 0, 1, 0, 1, 1), (1, 0, 0, 0, 1, 2)], (0, 0, 0), 0.9, 0.02)
    assert scenario is not None
    count = len(scenario.times)
    still = motion(scenario.times, np.repeat(scenario.scene.position[np.newaxis], count, axis=0))
    moved = still.position + np.array([0.5, 0.0]) * scenario.times[:, np.newaxis, np.newaxis]
    return Smallest(scenario, "sphere 0 rests", still, motion(scenario.times, moved))


def motion(t: Array, position: Array) -> Trajectory:
    """Spheres at these places that do not turn."""
    zero = np.zeros(position.shape[:2])
    return Trajectory(t, position, np.zeros_like(position), zero, zero)


def colours(data: bytes) -> set[tuple[int, ...]]:
    """Those that occur in a PNG."""
    return set(map(tuple, np.asarray(Image.open(BytesIO(data))).reshape(-1, 3).tolist()))


def test_a_picture_shows_the_start_the_exact_answer_and_yours():
    """In three colours, without the exact answer in two; in words which sphere is which."""
    url = data_url(smallest())
    seen = colours(b64decode(url.partition(",")[2]))
    alone = colours(png(drawn(replace(smallest(), right=None))))

    assert url.startswith("data:image/png;base64,")
    assert {RIGHT, YOURS} <= seen
    assert RIGHT not in alone
    assert START not in {RIGHT, YOURS}
    assert "sphere 0 rests. Sphere 0 starts at (-0.5, 0) m" in label(smallest())


@pytest.mark.parametrize("place", [np.nan, np.inf, -1e300, 10 * FARTHEST])
def test_a_motion_that_leaves_for_nowhere_has_a_picture(place: float):
    """Also if all of it is there; the picture keeps its size."""
    yours = smallest().yours
    gone = replace(yours, position=np.full_like(yours.position, place))
    one = replace(smallest(), yours=gone, right=None)

    assert max(drawn(one).size) <= max(drawn(smallest()).size) + 1
    assert RIGHT in colours(png(drawn(replace(one, right=smallest().right))))


def test_the_loudest_file_and_its_pictures_fit_into_what_prairielearn_reads(
    monkeypatch: pytest.MonkeyPatch,
):
    """Pictures that do not are left out from the last on; as its schema says."""
    said = "\N{PILE OF POO}" * LONGEST
    loud = marked(*(row(task, "x", "fault", said) for task in ("1", "2a", "2b", "2c", "2d")))
    loud = replace(loud, scenes=[smallest()] * 3)
    whole, without = (FORMATS["prairielearn"].text([one]) for one in (loud, marked()))
    size = len(whole.encode())
    monkeypatch.setattr(prairielearn, "LARGEST", size - 1)
    cut = json.loads(FORMATS["prairielearn"].text([loud]))

    jsonschema.validate(json.loads(whole), schema_of("prairielearn"))
    assert size <= LARGEST
    assert len(json.loads(whole)["images"]) == 3
    assert len(cut["images"]) == 2
    assert "images" not in json.loads(without)
