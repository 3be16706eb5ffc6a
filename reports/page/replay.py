"""Packs the trajectories of a comparison into a few kilobytes for the page's player.

A pack is, deflated: uint32 length of a JSON head, the head, then for every layer the numbers the
head announces, all little-endian uint16: positions on a grid over the layer's bounding box (second
differences in time, zigzag, high bytes before low bytes: steady motion becomes zeros), angles on a
grid over a turn if anything turns, and the collisions.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from crosscheck2d.adapters.run import Run
from crosscheck2d.reports.page.style import TRUTH
from crosscheck2d.scenarios.model import Array, Scenario, Trajectory

if TYPE_CHECKING:
    from crosscheck2d.reports.compare.comparison import Comparison

FRAMES = 240
# positions in a layer, so that a crowd of 100 disks fits into the page
NUMBERS = 10_000
COLLISIONS = 300  # collision marks in a layer at most: more hide the disks
GRID = 16383  # steps of the position grid over the box of a layer: fractions of a pixel
STEPS = 65535  # of instants, and of a turn less one
Layers = list[tuple[Run | None, Trajectory]]


def pack_layers(
    scenario: Scenario,
    layers: Layers,
    samples: NDArray[np.int64] | None = None,
    more: Mapping[str, Any] = MappingProxyType({}),
) -> str:
    """The layers at these samples (default: `frames`), packed, as base64; "" if there are none.

    more: further keys of the head: `opens` s, where the player starts; `pace`, simulated seconds
        per second at speed 1; `event`, what to mark: t s, disk.
    """
    if not layers:
        return ""
    samples = frames(scenario, layers) if samples is None else samples
    heads, bodies = zip(*(pack_layer(run, path, samples, scenario) for run, path in layers))
    scene = scenario.scene
    head = {
        "duration": scenario.duration,
        "steps": GRID,
        "t": rounded(scenario.times[samples]),
        "radius": rounded(scene.radius),
        "static": scene.static.astype(int).tolist(),
        "walls": rounded(scene.walls.reshape(-1, 4)),
        "wrap": None if scene.wrap is None else rounded(scene.wrap.ravel()),
        "view": rounded(view_of(scenario, [trajectory for _, trajectory in layers])),
        **more,
        "layers": heads,
    }
    text = json.dumps(head, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    packed = zlib.compress(len(text).to_bytes(4, "little") + text + b"".join(bodies))
    return base64.b64encode(packed).decode()


def played(comparison: Comparison) -> Layers:
    """What can be drawn: (run, trajectory) at the middle dt, and (None, truth) last, so that it
    lies on top."""
    layers: Layers = [
        (run, run.trajectory) for run in comparison.middle_runs if run.trajectory is not None
    ]
    truth = comparison.truth
    return [*layers, (None, truth)] if truth is not None and len(truth) else layers


def name_of(run: Run | None) -> str:
    """The layer's name: `engine:profile`, or "truth"."""
    return TRUTH if run is None else run.name


def frames(scenario: Scenario, layers: Layers) -> NDArray[np.int64]:
    """The samples to draw: evenly spaced ones, and those nearest to the last layer's collisions if
    these are few."""
    count = int(min(FRAMES, max(60, NUMBERS // scenario.scene.n), scenario.intervals + 1))
    collisions = np.unique(
        np.rint(layers[-1][1].collisions.t / scenario.sample_interval).astype(int)
    )
    collisions = collisions[(collisions > 0) & (collisions < scenario.intervals)]
    collisions = collisions if len(collisions) < count // 4 else collisions[:0]
    even = np.rint(np.linspace(0, scenario.intervals, count - len(collisions))).astype(int)
    return np.unique(np.concatenate([even, collisions]))


def view_of(scenario: Scenario, trajectories: list[Trajectory]) -> Array:
    """(4,) m, left, bottom, right, top: all of the last trajectory, and those parts of the others
    that are not far away."""
    scene = scenario.scene
    r = scene.radius[:, None]
    boxes = np.array(
        [
            [(t.position - r).min(axis=(0, 1)), (t.position + r).max(axis=(0, 1))]
            for t in trajectories
            if len(t) and np.isfinite(t.position).all()
        ]
        or [[[-1.0, -1.0], [1.0, 1.0]]]
    )
    base = boxes[-1]
    room = 0.5 * np.maximum(base[1] - base[0], 2 * scene.radius.max())
    low = np.maximum(boxes[:, 0].min(axis=0), base[0] - room)
    high = np.minimum(boxes[:, 1].max(axis=0), base[1] + room)
    if scene.wrap is not None:
        low, high = np.minimum(low, scene.wrap[0]), np.maximum(high, scene.wrap[1])
    if len(scene.walls):
        ends = scene.walls.reshape(-1, 2)
        margin = 0.1 * (high - low).max()
        low = np.minimum(low, np.clip(ends.min(axis=0), low - margin, None))
        high = np.maximum(high, np.clip(ends.max(axis=0), None, high + margin))
    return np.concatenate([low, high])


def ratio_of(scenario: Scenario, layers: Layers) -> float:
    """Height over width of the view, so that the page reserves its space before unpacking."""
    left, bottom, right, top = view_of(scenario, [trajectory for _, trajectory in layers])
    return float(round((top - bottom) / (right - left), 4))


def pack_layer(
    run: Run | None, trajectory: Trajectory, samples: NDArray[np.int64], scenario: Scenario
) -> tuple[dict[str, Any], bytes]:
    first = round(trajectory.t[0] / scenario.sample_interval)
    rows = samples[samples < first + len(trajectory)] - first
    position = trajectory.position[rows].reshape(len(rows), -1, 2)
    finite = np.nan_to_num(position, nan=0.0, posinf=1e9, neginf=-1e9)
    low, high = finite.min(axis=(0, 1)), finite.max(axis=(0, 1))
    span = np.where(high > low, high - low, 1.0)
    grid = np.rint((finite - low) / span * GRID).astype(np.uint16)
    body = smoothed(grid.reshape(len(rows), -1))
    turns = bool(trajectory.angle.any())
    if turns:
        turn = np.nan_to_num(trajectory.angle[rows]) / (2 * np.pi)
        body += smoothed(np.rint((turn % 1.0) * (STEPS + 1)).astype(np.uint32).astype(np.uint16))
    collisions = trajectory.collisions
    marks = len(collisions) if len(collisions) <= COLLISIONS else 0
    if marks:
        instant = np.rint(np.clip(collisions.t / scenario.duration, 0, 1) * STEPS)
        bodies = [collisions.i, np.where(collisions.j < 0, STEPS, collisions.j)]
        body += np.concatenate([instant, *bodies]).astype("<u2").tobytes()
    head = {
        "name": name_of(run),
        "frames": len(rows),
        "low": [float(x) for x in low],
        "span": [float(x) for x in span],
        "turns": turns,
        "marks": marks,
        "collisions": len(collisions),
        "ends": "" if len(rows) == len(samples) else f"{trajectory.t[-1]:.4g}",
    }
    return head, body


def smoothed(values: NDArray[np.uint16]) -> bytes:
    """(k, m) numbers as bytes that deflate well; inverse of `smooth` in player.js."""
    slope = np.diff(values, n=1, axis=0, prepend=np.uint16(0))
    twice = np.diff(slope, n=1, axis=0, prepend=np.uint16(0)).astype(np.int16)
    zigzag = ((twice << 1) ^ (twice >> 15)).astype(np.uint16)
    return (zigzag >> 8).astype(np.uint8).tobytes() + (zigzag & 255).astype(np.uint8).tobytes()


def rounded(values: Array) -> Any:
    """Nested lists of numbers to seven significant digits, finer than the position grid."""
    if np.ndim(values) > 1:
        return [rounded(row) for row in values]
    return [float(f"{x:.7g}") for x in np.asarray(values, float)]
