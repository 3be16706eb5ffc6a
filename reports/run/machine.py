"""What every table and page carries: machine, versions, seed, command."""

from __future__ import annotations

import os
import platform
from datetime import UTC, datetime
from pathlib import Path
from time import sleep
from typing import Any

from reports.run.cells import source_hash, versions


def about(command: str, seed: int) -> dict[str, Any]:
    """The header of a run."""
    return {
        "command": command,
        "seed": seed,
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
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
        },
    }


def busy_cores(seconds: float = 0.5) -> float:
    """How many cores others keep busy while this process sleeps so long; nan where the system does
    not tell."""
    try:
        before = _ticks()
        sleep(seconds)
        after = _ticks()
    except (OSError, ValueError):
        return float("nan")
    passed, idle = (later - earlier for later, earlier in zip(after, before))
    return (1 - idle / max(passed, 1)) * (os.cpu_count() or 1)


def _ticks() -> tuple[int, int]:
    """All ticks of all cores since the system began, and those without work (man 5 proc: idle and
    iowait)."""
    ticks = [
        int(field)
        for field in Path("/proc/stat").read_text(encoding="utf-8").splitlines()[0].split()[1:]
    ]
    return sum(ticks[:8]), ticks[3] + ticks[4]


def processor() -> str:
    """The processor's name where the system reports it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "unknown"
