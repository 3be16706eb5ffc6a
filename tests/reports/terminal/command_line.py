"""`crosscheck` as tests call it: in a process of its own, or, where that makes no difference, in
this one, sooner."""

import contextlib
import fcntl
import os
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Thread
from typing import NamedTuple
from unittest import mock

import pytest
from typer.testing import CliRunner

from crosscheck2d.reports.cli import app
from tests.forks import crosscheck_in, start

CROSSCHECK = Path(sys.executable).parent / "crosscheck"


class Done(NamedTuple):
    returncode: int
    stdout: str
    stderr: str


def process(*words: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [CROSSCHECK, *words], cwd=cwd, capture_output=True, text=True, timeout=300
    )


def crosscheck(*words: str | Path, cwd: Path) -> Done:
    argv = ["crosscheck", *map(os.fspath, words)]
    with contextlib.chdir(cwd), mock.patch.object(sys, "argv", argv):
        done = CliRunner().invoke(app, argv[1:], catch_exceptions=False)
    return Done(done.exit_code, done.stdout, done.stderr)


def forked(*words: str | Path, cwd: Path) -> Done:
    with TemporaryDirectory() as folder:
        process = start(
            crosscheck_in, [*map(os.fspath, words)], cwd, Path(folder), {"COLUMNS": "400"}
        )
        process.join(120.0)
        if process.exitcode is None:
            process.kill()
            pytest.fail(f"crosscheck {words} hangs")
        stdout, stderr = ((Path(folder) / name).read_text("utf-8") for name in ("stdout", "stderr"))
    return Done(process.exitcode, stdout, stderr)


def wait_for(done: Callable[[], bool]) -> None:
    for _ in range(2400):
        if done():
            return
        time.sleep(0.05)
    pytest.fail("nothing happened within two minutes")


def on_terminal(columns: int, *words: str | Path, cwd: Path) -> Done:
    ours, theirs = os.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 40, columns, 0, 0))
    # rich asks the terminal for its width only where COLUMNS is no number
    environment = {"COLUMNS": "", "TERM": "xterm-256color"}
    written: list[bytes] = []
    with TemporaryDirectory() as folder:
        for name in ("stdout", "stderr"):
            (Path(folder) / name).symlink_to(os.ttyname(theirs))
        process = start(crosscheck_in, [*map(os.fspath, words)], cwd, Path(folder), environment)
        reading = Thread(target=read_all, args=(ours, written))
        reading.start()
        process.join(120.0)
        os.close(theirs)
        reading.join(5.0)
        os.close(ours)
    if process.exitcode is None:
        process.kill()
        pytest.fail(f"crosscheck {words} hangs")
    return Done(process.exitcode, b"".join(written).decode(), "")


def read_all(terminal: int, written: list[bytes]) -> None:
    with contextlib.suppress(OSError):  # how Linux says so
        while some := os.read(terminal, 65536):
            written.append(some)
