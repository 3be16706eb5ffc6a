"""The event engine against a second algorithm, that of `frictional_motion`: all contacts as
polynomials, all roots by numpy, nothing kept from one event to the next; and whether that would
notice a bug."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from crosscheck2d.adapters.event_driven import events
from crosscheck2d.adapters.event_driven.events import EventEngine
from crosscheck2d.scenarios.families.placing import box, scatter
from crosscheck2d.scenarios.model import Scene
from crosscheck2d.scenarios.no_truth import NoTruth
from tests.adapters.event_driven.gases import collisions_of
from tests.independent.frictional_motion import next_contact, resolve


def brute_force(scene, side, count):
    """Up to `count` collisions as (t, i, j) within 5 s, and when it stopped and where; side: of the
    torus, or 0."""
    x, v, spin = scene.position.copy(), scene.velocity.copy(), np.zeros(scene.n)
    a = np.where(scene.static[:, None], 0.0, scene.gravity)
    images = side * np.array([[k, m] for k in (-1, 0, 1) for m in (-1, 0, 1)]) if side else [[0, 0]]
    now, collisions = 0.0, []
    while len(collisions) < count:
        if side:
            x = np.mod(x, side)
        t, i, j, way = next_contact(scene, x, v, images)
        t = min(t, 0.2 if side else 10.0)  # in 0.2 s nobody passes the next image
        if now + t > 5:
            break
        x, v, now = x + v * t + a * t * t / 2, v + a * t, now + t
        if t not in (0.2, 10.0):
            resolve(scene, i, j, way, v, spin)
            collisions.append((now, *((i, j) if j < 0 or i < j else (j, i))))
    return collisions, now, x


def random_scene(seed):
    """A box, a torus, or an open place with loose walls; any radii and masses, some static, gravity
    or none."""
    draw = np.random.default_rng(seed)
    n, kind = int(draw.integers(2, 7)), ("box", "torus", "open")[seed % 3]
    radius = draw.uniform(0.05, 0.3, n)
    walls = {"box": box([-1.6, -1.3], [1.7, 1.5]), "torus": np.zeros((0, 2, 2))}.get(kind)
    if walls is None:
        walls = draw.uniform(-1, 1, (2, 2, 2)) + [[[0, -2.4]], [[0, 2.4]]]
    position = (
        scatter(draw, [0.01, 0.01], [1.79, 1.79], radius)
        if kind == "torus"
        else scatter(draw, [-1.2, -0.9], [1.3, 1.1], radius)
    )
    mass = np.where(draw.random(n) < 0.2, np.inf, draw.uniform(0.3, 5, n))
    return Scene(
        position=position,
        velocity=np.where(np.isinf(mass)[:, None], 0.0, draw.normal(size=(n, 2))),
        radius=radius,
        mass=mass,
        walls=walls,
        restitution=float(draw.choice([0.6, 0.9, 1.0])),
        gravity=draw.normal(size=2) * (draw.random() < 0.6),
    ), (1.8 if kind == "torus" else 0.0)


def compare(seed):
    scene, side = random_scene(seed)
    try:
        engine = EventEngine(scene, [[0, 0], [side, side]] if side else None)
    except NoTruth:  # a disk lies across the edge of the torus, or on a wall, and on another disk
        return
    collisions, now, x = brute_force(scene, side, 8)
    engine.advance(now + 1e-9)
    found = collisions_of(engine)[: len(collisions)]
    # Eight collisions of disks a tenth as large as their paths: each may take a digit from the
    # sixteen there are.
    np.testing.assert_allclose(
        np.array(found).reshape(-1, 3), np.array(collisions).reshape(-1, 3), rtol=0, atol=1e-7
    )
    apart = engine.motion_at(now)[0] - x
    apart -= side * np.round(apart / side) if side else 0
    assert np.abs(apart).max() < 1e-7


def compare_all(seeds):
    for seed in seeds:
        compare(seed)


@pytest.mark.slow
@settings(derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_a_brute_force_algorithm_finds_the_same_collisions(seed):
    compare(seed)


FILES = ("disks", "search", "rest", "impacts", "loop")
DEAR = ("stale record kept", "wall end forgotten")  # a second each: of thirty scenes and more
BUGS = {
    "stale record kept": ("b.count == a.partner_count", "True"),
    "nearest image": (
        "dx, dy = b.x - x + image(b.cx - cx, g.shift[0]), b.y - y + image(b.cy - cy, g.shift[1])",
        (
            "dx = b.x - x\n        dx -= g.span[0] * np.round(dx / g.span[0]) * g.torus\n        dy"
            " = b.y - y\n        dy -= g.span[1] * np.round(dy / g.span[1]) * g.torus"
        ),
    ),
    "contact found late": (
        "t = max(gap, 0.0) / (sqrt(max(disc, 0.0)) - closing)",
        "t = (sqrt(max(disc, 0.0)) - closing) / (ux * ux + uy * uy)",
    ),
    "wall end forgotten": ("for part in range(3)", "for part in range(1)"),
    "static disk falls along": ("arena.rules.mixed and (b.ax", "False and (b.ax"),
    "new cells not searched": (
        "if beyond == ALL:",
        "if beyond != ALL: return 0\n    if beyond == ALL:",
    ),
}


def plain_kernels(right="", wrong=""):
    folder = Path(events.__file__).parent
    source = "\n".join((folder / f"{name}.py").read_text() for name in FILES)
    ours = r"from crosscheck2d\.adapters\.event_driven\.\w+ import (\([^)]*\)|.*)"
    source = re.sub(rf"from __future__.*|@kernel|@inlined_early|@inlined|{ours}", "", source)
    assert right in source
    names: dict = {"__name__": "plain"}
    exec(source.replace(right, wrong) if right else source, names)
    # Compiled (error_model="numpy") a division by zero gives an infinity or nan in silence, which
    # the kernels use.
    quiet = np.errstate(divide="ignore", invalid="ignore")
    return SimpleNamespace(
        **names | {name: quiet(names[name]) for name in ("begin", "advance", "accelerate")}
    )


@pytest.mark.slow
def test_the_kernels_as_plain_python_find_the_same(monkeypatch):
    monkeypatch.setattr(events, "event_loop", plain_kernels())
    compare_all(range(12))


@pytest.mark.parametrize(
    "bug", [pytest.param(bug, marks=[pytest.mark.slow] * (bug in DEAR)) for bug in BUGS]
)
def test_a_planted_bug_is_caught_by_brute_force(bug, monkeypatch):
    monkeypatch.setattr(events, "event_loop", plain_kernels(*BUGS[bug]))
    with pytest.raises((AssertionError, NoTruth)):
        compare_all(range(40))
