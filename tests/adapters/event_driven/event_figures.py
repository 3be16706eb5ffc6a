"""The long validations of the event engine as a table: `uv run python
tests/adapters/event_driven/event_figures.py` writes it anew.

Ten million collisions of 1024 disks on a torus, e = 1, at each packing; `test_event_gases` plays
them again and compares.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from crosscheck2d.adapters.event_driven.events import EventEngine
from crosscheck2d.reports.stability.predicates_gas import compressibility
from tests.adapters.event_driven.gases import gas

TABLE = Path(__file__).parents[3] / "tests" / "data" / "event_figures.csv"
PACKINGS = (0.1, 0.2, 0.3, 0.4, 0.5)
DISKS, COLLISIONS, BLOCKS = 1024, 10_000_000, 50


def measured(
    packing: float, disks: int = DISKS, collisions: int = COLLISIONS, blocks: int = BLOCKS
) -> dict[str, float]:
    """One row: Z from the virial of the collisions, their rate, their errors from blocks, and what
    must not drift.

    Z = 1 + sum of impulses / (2 N kT t), kT = K / (N - 1); rate = 4 / sqrt(pi) (Z - 1) (Enskog), in
    units of the disks' diameter, mass and kT. The first 200 collisions of each disk are left out.
    """
    scene, torus = gas(disks, packing)
    engine, z = EventEngine(scene, torus), compressibility(packing)
    rate = 4 / np.sqrt(np.pi) * (z - 1)
    at = 200 / rate
    engine.advance(at)
    engine.kept.clear()
    _, start = engine.motion_at(at)
    kinetic, span = (start**2).sum() / 2 / (disks - 1), collisions / (rate * disks / 2) / blocks
    impulses, counts = np.zeros(blocks), np.zeros(blocks)
    for block in range(blocks):
        at += span
        engine.advance(at)
        impulses[block], counts[block] = engine.collisions[:, 3].sum(), len(engine.collisions)
        engine.kept.clear()
    _, end = engine.motion_at(at)
    found, rates = 1 + impulses / (2 * disks * kinetic * span), 2 * counts / disks / span
    v2 = (end**2).sum(axis=1)
    return {
        "packing": packing,
        "disks": disks,
        "collisions": int(counts.sum()),
        "Z": found.mean(),
        "Z_error": found.std(ddof=1) / np.sqrt(blocks),
        "Z_reference": z - (z - 1) / disks,
        "rate": rates.mean(),
        "rate_error": rates.std(ddof=1) / np.sqrt(blocks),
        "rate_reference": rate * (1 - 1 / disks),
        "v4_over_v2_squared": (v2**2).mean() / v2.mean() ** 2,
        "energy_drift": abs((end**2).sum() / (start**2).sum() - 1),
        "momentum_drift": np.abs(end.sum(axis=0) - start.sum(axis=0)).max() / np.abs(end).sum(),
    }


def read() -> dict[float, dict[str, float]]:
    return pd.read_csv(TABLE, index_col="packing").assign(packing=PACKINGS).to_dict("index")


def main() -> None:
    table = pd.DataFrame([measured(packing) for packing in PACKINGS])
    table.to_csv(TABLE, index=False, float_format="%.9g")
    print(TABLE.read_text())


if __name__ == "__main__":
    main()
