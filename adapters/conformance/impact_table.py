"""What each engine does with e and friction: for each engine and step size the median and the range
of 32 readings, which differ in the phase of the collision within its step and the angles of the
disks, or in the height of a fall.

`uv run --extra js python -m crosscheck2d.adapters.conformance.impact_table` asks all engines again,
and writes impact_table.csv and the table of adapters/README.md; it takes half a minute. With names
of engines behind it, it asks only those, and keeps the rows of all others.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import replace
from datetime import date
from functools import partial
from pathlib import Path
from textwrap import wrap

import numpy as np
import pandas as pd

from crosscheck2d.adapters.conformance.physics import FRICTION
from crosscheck2d.adapters.conformance.probe import DT, scene_of
from crosscheck2d.adapters.engine import Engine, Unsupported
from crosscheck2d.adapters.engine_row import FLOAT32, EngineRow
from crosscheck2d.adapters.engines import ENGINES, FETCHED
from crosscheck2d.scenarios.model import Array, Scene

KEPT = Path(__file__).with_name("impact_table.csv")
README = Path(__file__).parents[1] / "README.md"
MARK = "impact table"
STEP_SIZES = (DT, 1 / 60)  # s
COUNT = 32  # readings of a cell
PHASES = (np.arange(COUNT) + 0.5) / COUNT  # of a step, at which the bodies touch
ANGLES = 2 * np.pi * ((np.arange(COUNT) * 0.618) % 1)  # rad: the golden section spreads them evenly
ROWS_APART = 2.0 * np.arange(COUNT) - COUNT + 1  # m, y of the collisions: they do not meet
FREE = [0.0, COUNT + 4.0]  # m, of a disk that meets nothing
SLOWEST, FASTEST = 1e-3, 20.0  # m/s, range in which a threshold is searched; 2/3 radii in 1/60 s
NEAR = 0.05  # of e: a smaller difference from e at `FASTEST` counts as equal
BOUNCES = 5
HEIGHTS = np.linspace(1.9, 2.1, COUNT)  # m


def pairs(speed: float | Array, dt: float, spin: float = 0.0, scale: float = 1.0) -> Scene:
    """`COUNT` pairs of equal disks that meet along x at `speed` m/s after 4 steps and their phase,
    with all lengths `scale` times as long, and a free disk; e = 0.5."""
    gap, still = speed * dt * (4 + PHASES), 0 * PHASES
    position = np.stack([-0.5 - gap / 2, ROWS_APART, 0.5 + gap / 2, ROWS_APART], axis=1)
    velocity = np.stack([still + speed / 2, still, still - speed / 2, still], axis=1)
    return scene_of(
        scale * np.vstack([position.reshape(-1, 2), FREE]),
        scale * np.vstack([velocity.reshape(-1, 2), [2.0, 0.0]]),
        radius=0.5 * scale,
        angle=np.append(np.repeat(ANGLES, 2), 0.0),
        angular_velocity=np.full(2 * COUNT + 1, spin),
        inertia=np.full(2 * COUNT + 1, 0.125 * scale**2),
    )


def collide(engine: Engine, scene: Scene, dt: float) -> tuple[Array, Array]:
    """(n, 3) x, y, spin: the velocities of all disks but the last before and after the collisions.

    The last one is free: what the air of an engine takes from its speed is taken from those before,
    too. The polygons of matter meet later than disks do: all that have met nothing go on.
    """
    engine.load(scene, dt)
    start = velocities(engine)
    for _ in range(8):
        engine.step(24)
        after = velocities(engine)
        before = start * (after[-1, 0] / start[-1, 0])
        change = np.abs(after - before)[:-1, 0]
        if (change > 1e-3 * np.abs(before[:-1, 0])).all():
            break
    return before[:-1], after[:-1]


def velocities(engine: Engine) -> Array:
    """(n, 3) x, y, spin."""
    state = engine.read()
    return np.column_stack([state.velocity, state.angular_velocity])


def restitution(engine: Engine, dt: float, speed: float | Array = 2.0, scale: float = 1.0) -> Array:
    states = collide(engine, pairs(speed, dt, scale=scale), dt)
    before, after = (state[1::2, 0] - state[::2, 0] for state in states)
    return np.where(after > 0.999 * before, -after / before, np.nan)


def threshold(engine: Engine, dt: float) -> Array:
    """m/s: the closing speed from which on a pair bounces as it does at `FASTEST`, to 1 %; 0 if it
    already does at `SLOWEST`."""
    usual = restitution(engine, dt, FASTEST)
    low, high = np.full(COUNT, SLOWEST), np.full(COUNT, FASTEST)
    always = np.abs(restitution(engine, dt, low) - usual) < NEAR
    while not always.all() and (high > 1.01 * low).any():
        middle = np.sqrt(low * high)
        bounces = np.abs(restitution(engine, dt, middle) - usual) < NEAR
        low, high = np.where(bounces, low, middle), np.where(bounces, middle, high)
    return np.where(always, 0.0, high)


def wall_restitution(engine: Engine, dt: float) -> Array:
    at = np.stack([-2.0 * dt * (4 + PHASES), ROWS_APART], axis=1)
    scene = scene_of(
        np.vstack([at, FREE]),
        [2.0, 0.0],
        mass=7.3,
        angle=np.append(ANGLES, 0.0),
        walls=[[[0.5, -COUNT - 1], [0.5, COUNT + 1]]],
    )
    before, after = collide(engine, scene, dt)
    return -after[:, 0] / before[:, 0]


def height_gained(engine: Engine, dt: float) -> Array:
    """%, of the height that a disk dropped with e = 1 gains in `BOUNCES` bounces, between this and
    the next one; 0 is exact, -100 that it lies on the floor."""
    gravity, radius = 10.0, 0.25
    scene = scene_of(
        np.stack([ROWS_APART / 2, radius + HEIGHTS], axis=1),
        radius=radius,
        restitution=1.0,
        angle=ANGLES,
        gravity=[0.0, -gravity],
        walls=[[[-COUNT, 0.0], [COUNT, 0.0]]],
    )
    engine.load(scene, dt)
    # The top is due after 10 times the time of a fall; a fifth later, as the height may grow.
    steps, every = round(12 * (2 * HEIGHTS.max() / gravity) ** 0.5 / dt), round(1 / 32 / dt)
    if expect := getattr(engine, "expect", None):
        expect(every, steps // every)
    height, speed = np.empty((2, steps // every, COUNT))
    for k in range(steps // every):
        engine.step(every)
        state = engine.read()
        height[k], speed[k] = state.position[:, 1] - radius, state.velocity[:, 1]
    count = np.cumsum((speed[:-1] < 0) & (speed[1:] > 0), axis=0)
    last = np.minimum(count[-1], BOUNCES)  # of a disk that has come to rest, the last one
    top = np.argmax(np.where(count == last, height[1:], 0.0), axis=0) + 1
    # The flight is a parabola in the number of the sample: its top from the three highest ones.
    low, middle, high = (
        height[np.clip(top + side, 0, len(height) - 1), range(COUNT)] for side in (-1, 0, 1)
    )
    apex = middle + divide((high - low) ** 2, 8 * (2 * middle - low - high))
    gained: Array = 100 * (np.where(np.isnan(apex), middle, apex) / HEIGHTS - 1)
    return gained


def impulses(
    engine: Engine, dt: float, restitution: float, friction: float
) -> tuple[Array, Array, Array]:
    """Of a disk of each pair, where both spin so fast that they slide all through the collision:
    the normal and the sideways change of its velocity, and that of its spin."""
    scene = replace(pairs(2.0, dt, spin=40.0), restitution=restitution, friction=friction)
    before, after = collide(engine, scene, dt)
    normal, sideways, turned = (after - before)[::2].T
    return normal, sideways, turned


def effective_friction(
    engine: Engine, dt: float, restitution: float = 0.5, friction: float = FRICTION
) -> Array:
    """Sideways over normal momentum of a disk; NaN if it met nothing."""
    normal, sideways, _ = impulses(engine, dt, restitution, friction)
    return np.abs(divide(sideways, normal))


def lever(engine: Engine, dt: float) -> Array:
    """The lever arm by which friction turns a disk in a bounce, in radii; NaN without friction."""
    normal, sideways, spin = impulses(engine, dt, 0.5, FRICTION)
    sideways = np.where(np.abs(sideways) > 1e-3 * np.abs(normal), sideways, 0.0)
    return np.abs(divide(0.125 * spin, sideways)) / 0.5


def divide(a: Array, b: Array) -> Array:
    quotient: Array = np.divide(a, b, out=np.full(len(b), np.nan), where=b != 0)
    return quotient


def fast_spin(engine: Engine, dt: float) -> Array:
    # rad/s, of free disks that start with 300 rad/s, after 4 steps.
    position, spin = np.stack([0 * ROWS_APART, ROWS_APART], axis=1), np.full(COUNT, 300.0)
    engine.load(scene_of(position, angle=ANGLES, angular_velocity=spin), dt)
    engine.step(4)
    return engine.read().angular_velocity


# A column of the file -> its heading in README, and what takes its `COUNT` readings of an engine.
COLUMNS: dict[str, tuple[str, Callable[[Engine, float], Array]]] = {
    "threshold": ("bounces from m/s", threshold),
    "e_slow": ("e at 0.1 m/s", partial(restitution, speed=0.1)),
    "e_2": ("e at 2 m/s", restitution),
    "e_wall": ("e on a wall", wall_restitution),
    "e_small": ("e of 5 mm disks", partial(restitution, scale=0.01)),
    "energy": (f"height gained in {BOUNCES} bounces, e = 1, %", height_gained),
    "friction_unasked": ("friction, none stated", partial(effective_friction, friction=0.0)),
    "friction_0": ("friction at e = 0", partial(effective_friction, restitution=0.0)),
    "friction_1": ("friction at e = 1", partial(effective_friction, restitution=1.0)),
    "lever": ("lever arm of friction", lever),
    "spin": ("300 rad/s after 4 steps", fast_spin),
}
RANGE = ("", "_low", "_high")  # of a column of the file: the median, the least, the most
ROWS = ENGINES | FETCHED


def rows_of_table(name: str, row: EngineRow) -> list[dict[str, float | str]]:
    rows = list[dict[str, float | str]]()
    with closing(row.make()) as engine:
        for dt in STEP_SIZES:
            cells: dict[str, float | str] = {"engine": name, "dt": f"1/{round(1 / dt)} s"}
            for key, (_, read) in COLUMNS.items():
                numbers = np.full(1, np.nan)
                with suppress(Unsupported):
                    numbers = read(engine, dt)
                met = numbers[~np.isnan(numbers)] if (~np.isnan(numbers)).any() else numbers
                spread = (np.median(met), met.min(), met.max())
                cells |= {f"{key}{end}": float(at) for end, at in zip(RANGE, spread)}
            cells["numbers"] = "float32" if row.rounding == FLOAT32 else "float64"
            cells["date"] = date.today().isoformat()
            cells["versions"] = ", ".join(map(" ".join, engine.versions().items()))
            rows.append(cells)
    return rows


def table_of(rows: Mapping[str, EngineRow]) -> pd.DataFrame:
    """A row for each engine and step size: engine, dt, `COLUMNS`, numbers, date, versions."""
    return pd.DataFrame([cells for name, row in rows.items() for cells in rows_of_table(name, row)])


def kept() -> pd.DataFrame:
    return pd.read_csv(KEPT, keep_default_na=False, na_values=["", "nan"])


def in_markdown(table: pd.DataFrame) -> str:
    headings = ["engine", "dt", *(heading for heading, _ in COLUMNS.values()), "numbers"]
    lines = [f"| {' | '.join(headings)} |", "|---" * len(headings) + "|"]
    for row in table.to_dict("records"):
        cells = [cell(key, *(row[f"{key}{end}"] for end in RANGE)) for key in COLUMNS]
        lines.append(f"| `{row['engine']}` | {' | '.join([row['dt'], *cells, row['numbers']])} |")
    versions = dict.fromkeys(", ".join(table.versions).split(", "))
    days = " to ".join(dict.fromkeys((table.date.min(), table.date.max())))
    text = f"Read on {days} with {', '.join(versions)}."
    return "\n".join([*lines, "", *wrap(text, 120)]) + "\n"


def cell(column: str, *spread: float) -> str:
    # The median in the digits of its column, and the range if that has others; "-" for none.
    if np.isnan(spread[0]):
        return "-"
    form = {"energy": "{:+.1f}", "threshold": "{:.2g}"}.get(column, "{:.3g}")
    places = 1 if column == "energy" else 5  # + 0.0 avoids -0.0
    middle, least, most = (form.format(round(number, places) + 0.0) for number in spread)
    return middle if least == most else f"{middle} ({least} to {most})"


def replace_table(text: str, mark: str, table: str) -> str:
    begin, end = f"<!-- {mark} -->\n", f"<!-- end of {mark} -->"
    before, _, rest = text.partition(begin)
    return before + begin + table + end + rest.partition(end)[2]


def with_anew(engines: Sequence[str]) -> pd.DataFrame:
    anew = table_of({name: row for name, row in ROWS.items() if name.split(":")[0] in engines})
    was = kept()
    both = pd.concat([was[~was.engine.isin(anew.engine)], anew]).set_index("engine", drop=False)
    return both.loc[[name for name in ROWS if name in both.index]]


def main(*engines: str) -> None:
    """Probe these engines, or all if none is named, and write the file and the table."""
    if unknown := {*engines} - {name.partition(":")[0] for name in ROWS}:
        sys.exit(f"no engine is called {', '.join(sorted(unknown))}")
    table = with_anew(engines) if engines else table_of(ROWS)
    table.to_csv(KEPT, index=False, float_format="%.10g")
    page = README.read_text(encoding="utf-8")
    README.write_text(replace_table(page, MARK, in_markdown(kept())), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
