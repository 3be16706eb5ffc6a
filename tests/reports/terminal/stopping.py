"""Starts a command, waits until it is somewhere, signals it to stop, and looks what is left of
it."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from tests.reports.terminal.command_line import CROSSCHECK, wait_for

STALLS = Path(__file__).parents[3] / "tests" / "data" / "stalls"
AT_MOST = 3.0  # s that a command may take to end, on a machine that does nothing else


class Ended(NamedTuple):
    status: int
    seconds: float
    said: str
    left: list[int]


class Command:
    def __init__(self, *words: str | Path, cwd: Path, stalled: str = "") -> None:
        self.cwd, self.mark = cwd, cwd / ".mark"
        mine = {"STALL": stalled, "STALL_MARK": str(self.mark), "PYTHONPATH": str(STALLS)}
        self.output, self.errors = cwd / ".stdout", cwd / ".stderr"
        with self.output.open("w") as output, self.errors.open("w") as errors:
            self.process = subprocess.Popen(
                [CROSSCHECK, *words],
                cwd=cwd,
                env=os.environ | mine,
                stdout=output,
                stderr=errors,
                start_new_session=True,
                preexec_fn=hears_ctrl_c,
            )

    def when(self, here: Callable[[], object]) -> Command:
        wait_for(lambda: here() or self.process.poll() is not None)
        assert self.process.poll() is None, self.errors.read_text()
        return self

    def stalled(self) -> Command:
        return self.when(self.mark.exists)

    def stop(self, how: int, whole_group: bool = False) -> Ended:
        started = time.monotonic()
        (os.killpg if whole_group else os.kill)(self.process.pid, how)
        try:
            status = self.process.wait(60)
        finally:
            seconds = time.monotonic() - started
            time.sleep(0.2)  # for the kernel to take down what was killed
            left = self.others()
            for pid in left:
                os.kill(pid, signal.SIGKILL)
        return Ended(128 - status if status < 0 else status, seconds, self.errors.read_text(), left)

    def others(self) -> list[int]:
        mark, found = f"STALL_MARK={self.mark}".encode(), []
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                ours = mark in (folder / "environ").read_bytes().split(b"\0")
                if ours and (folder / "stat").read_text().rpartition(")")[2].split()[0] != "Z":
                    found.append(int(folder.name))
            except OSError:
                continue  # it has just ended
        return found


def hears_ctrl_c() -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def busyness() -> float:
    return max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))


def assert_ended(ended: Ended, how: int) -> None:
    assert ended.seconds < AT_MOST * busyness(), ended
    assert ended.status == 128 + how, ended
    assert "Traceback" not in ended.said
    assert not ended.left
