"""`crosscheck truth`: the exact answer to one scene, its collisions, its horizon and what ends
it."""

from __future__ import annotations

import json
import sys
from contextlib import closing
from functools import partial
from math import isfinite
from typing import Any, NoReturn

import numpy as np

from crosscheck2d.reports.page.style import number
from crosscheck2d.reports.run.arguments import checked_scenes
from crosscheck2d.reports.run.comparing import compute_record, why_no_answer
from crosscheck2d.reports.run.pool import Failure, run_all
from crosscheck2d.reports.run.scenes import open_scene
from crosscheck2d.reports.terminal.console import Console, print_table, print_texts
from crosscheck2d.reports.terminal.exits import DONE, FAILED, refuse, say
from crosscheck2d.reports.terminal.progress import Progress
from crosscheck2d.scenarios.model import Scenario
from crosscheck2d.scenarios.truth.exact import CLOSED_FORM
from crosscheck2d.scenarios.truth.record import TWO_PRECISIONS, TruthRecord

SHOWN = 10  # collisions at the start and at the end
STATE = ("disk", "position_m", "velocity_m_s", "angle_rad", "angular_velocity_rad_s")
STATE_HEADINGS = ("disk", "x, m", "y, m", "vx, m/s", "vy, m/s", "angle, rad", "spin, rad/s")
HEADINGS = ("t, s", "disk", "with", "impulse, N s", "cosine of\nimpact angle")


def show_truth(
    scene: str, seed: int, every: bool, at: float | None, as_json: bool, timeout: float
) -> NoReturn:
    """Print the exact answer to a scene, as far as it is found in `timeout` s; exits 1 if there is
    none (at the time `at`, s), 2 if there is no such scene or time."""
    (checked,) = checked_scenes([scene], [], False, seed)
    scenario = open_scene(checked, seed)
    if at is not None and not 0 <= at <= scenario.duration:
        refuse(f"--at {at:g}: must be from 0 to {scenario.duration:g} s, the scene's duration")
    # In a worker, which can always be stopped.
    task = partial(compute_record, checked, seed, timeout)
    with Progress() as progress, closing(run_all({checked: task}, 1, timeout)) as results:
        progress.say(f"the exact answer to {scenario.name}")
        [(_, record)] = results
    if isinstance(record, Failure):
        reason = why_no_answer(record, timeout)
    elif isinstance(record, str):
        reason = f"no exact answer: {record}"
    elif at is not None and at > record.horizon:
        reason = f"no exact answer at {at:g} s: {record.reason}"
    else:
        print_answer(scenario, record, every, at, as_json)
        sys.exit(DONE)
    say(f"{scenario.name}: {reason}")
    sys.exit(FAILED)


def print_answer(
    scenario: Scenario, record: TruthRecord, every: bool, at: float | None, as_json: bool
) -> None:
    state = None if at is None else state_at(scenario, record, at)
    if as_json:
        written = as_plain(scenario, record) | ({"state": state} if state else {})
        print(json.dumps(written, indent=2, allow_nan=False))
    elif state is not None:
        console = Console()
        console.print(f"at {state['t_s']:.15g} s")
        rows = [
            [str(disk), *(f"{value:.15g}" for value in (*x, *v, angle, spin))]
            for disk, x, v, angle, spin in (disk.values() for disk in state["disks"])
        ]
        print_table(console, STATE_HEADINGS, rows)
    else:
        print_truth(scenario, record, every)


def state_at(scenario: Scenario, record: TruthRecord, at: float) -> dict[str, Any]:
    t = np.array([at])
    if record.method == CLOSED_FORM:
        assert scenario.truth is not None
        answer = scenario.truth(t)
        moved = answer.position, answer.velocity
        turned = answer.angle, answer.angular_velocity
    else:
        moved, turned = record.motion(scenario.scene, scenario.thrusts, t)
    disks = zip(*(part[0].tolist() for part in (*moved, *turned)))
    return {"t_s": at, "disks": [dict(zip(STATE, (i, *disk))) for i, disk in enumerate(disks)]}


def as_plain(scenario: Scenario, record: TruthRecord) -> dict[str, Any]:
    """The record as plain JSON values; numbers that are not finite become text or null."""
    collisions = [
        {
            "t_s": t,
            "i": int(i),
            "j": int(j),
            "impulse_Ns": impulse,
            "cosine": cosine if impulse and cosine > 0 else None,
        }
        for t, i, j, impulse, cosine in record.events.tolist()
    ]
    written: dict[str, Any] = plain(
        {
            "scenario": scenario.name,
            "method": record.method,
            "bits": record.bits,
            "duration_s": scenario.duration,
            "horizon_s": min(record.horizon, scenario.duration),
            "float64_horizon_s": min(record.float64_horizon, scenario.duration),
            "reason": record.reason,
            "error_bound_m": record.error_bound,
            "collisions": collisions,
            "outcomes": outcomes(record),
            "still_known": list(record.remains),
        }
    )
    return written


def plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [plain(item) for item in value]
    return str(value) if isinstance(value, float) and not isfinite(value) else value


def outcomes(record: TruthRecord) -> list[dict[str, Any]]:
    """The possible outcomes of a simultaneous collision: the velocity (m/s) of each disk, and one
    order of collisions that leads there."""
    return [
        {
            "velocities_m_s": {
                str(int(i)): [vx, vy]
                for _, i, vx, vy in record.outcomes[record.outcomes[:, 0] == k]
            },
            "order": [[int(i), int(j)] for _, i, j in record.orders[record.orders[:, 0] == k]],
        }
        for k in sorted({*record.outcomes[:, 0]})
    ]


def print_truth(scenario: Scenario, record: TruthRecord, every: bool) -> None:
    console = Console()
    duration, float64 = scenario.duration, min(record.float64_horizon, record.horizon)
    whole = record.horizon >= duration
    precision = "float64" if record.bits == 53 else f"{record.bits} bits"
    if record.method == TWO_PRECISIONS and record.bits != 53:
        precision += f", checked against {record.bits // 2}"
    lines = {
        "scenario": f"{scenario.name}: {scenario.asks}",
        "method": record.method,
        "precision": precision,
        "horizon": f"{number(min(record.horizon, duration), 6)} s of {number(duration, 6)} s",
        "ends because": record.reason or ("the scenario ends there" if whole else ""),
        "horizon of float64": f"{number(min(float64, duration), 6)} s",
        "error bound": (
            f"{number(record.error_bound, 2)} m" if record.error_bound else "a rounding of float64"
        ),
        "still known": "\n".join(record.remains),
        "collisions": str(int((record.events[:, 3] != 0).sum())),
    }
    print_texts(console, {name: text for name, text in lines.items() if text})
    if len(record.events):
        console.print()
        headings, *rows = rows_of_collisions(record, every)
        print_table(console, headings, rows, left=HEADINGS[2:4])
        if len({*record.events[:, 0]}) < len(record.events):
            console.print("Collisions at one instant are listed by disk, not in their order.")
    ends = outcomes(record)
    for k, end in enumerate(ends, 1):
        velocities = end["velocities_m_s"].items()
        lines = {
            "velocities, m/s": "\n".join(
                f"disk {disk}: ({vx:.6g}, {vy:.6g})" for disk, (vx, vy) in velocities
            ),
            "one order": ", ".join(f"{i} on {name(j)}" for i, j in end["order"]),
        }
        console.print()
        print_texts(console, lines, f"Outcome {k} of {len(ends)}; none is the truth")


def rows_of_collisions(record: TruthRecord, every: bool) -> list[list[str]]:
    rows = [list(HEADINGS)]
    for t, i, j, impulse, cosine in record.events.tolist():
        force = f"{impulse:.6g}" if impulse else "comes to rest"
        angle = f"{cosine:.6g}" if impulse and not np.isnan(cosine) else ""
        rows.append([f"{t:.12g}", str(int(i)), name(j), force, angle])
    if not any(row[-1] for row in rows[1:]):
        rows = [row[:-1] for row in rows]
    skipped = len(rows) - 1 - 2 * SHOWN
    if skipped > 0 and not every:
        rows[1 + SHOWN : -SHOWN] = [[f"{skipped} more: --events", *[""] * (len(rows[0]) - 1)]]
    return rows


def name(j: float) -> str:
    return f"disk {int(j)}" if j >= 0 else f"wall {-1 - int(j)}"
