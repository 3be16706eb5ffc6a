"""What every table and page carries: machine, versions, seed, command."""

from __future__ import annotations

import os
import platform
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import psutil

from crosscheck2d.adapters.system import LIMITED_BY
from crosscheck2d.reports.run.cells import source_hash, versions


def about(command: str, seed: int) -> dict[str, Any]:
    """The header of a run."""
    return {
        "command": command,
        "seed": seed,
        "started": datetime.now(UTC).isoformat(timespec="milliseconds"),
        "versions": {
            **versions(),
            "Python": platform.python_version(),
            "engines' source": source_hash(),
        },
        "machine": {
            "system": f"{platform.system()} {platform.release()}",
            "architecture": platform.machine(),
            "processor": processor(),
            "cores": os.cpu_count() or 1,
            "memory limited by": LIMITED_BY,
        },
    }


def busy_cores(seconds: float = 0.5) -> float:
    """Number of cores that other processes keep busy while this one sleeps for `seconds`; nan if
    the system does not report it."""
    try:
        share = psutil.cpu_percent(seconds) / 100
    except (OSError, ValueError):
        return float("nan")
    return float(share) * (os.cpu_count() or 1)


def processor() -> str:
    """The processor's name where the system reports it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "unknown"
