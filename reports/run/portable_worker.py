"""A worker process for systems on which it cannot inherit open files (macOS, Windows): it connects
over the loopback address, its trail is a named file, and a thread reads its output."""

from __future__ import annotations

import os
import secrets
import shutil
import socket
import subprocess
import tempfile
import threading
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from time import monotonic

from crosscheck2d.adapters import system
from crosscheck2d.adapters.safe_path import path_of_this, python
from crosscheck2d.reports.run import worker_process
from crosscheck2d.reports.run.worker import PRINTED, STARTING, Worker

WORK = "from crosscheck2d.reports.run.portable_worker import main; main(sys.argv[1:])"
KEY = "CROSSCHECK_WORKER"  # the variable with the key of our processes
LOOK = 0.05  # s between two checks whether a process that has not connected is still alive


class PortableWorker(Worker):
    """A `Worker` with other channels."""

    def start(self) -> None:
        """Start the process; it connects later."""
        self.folder = tempfile.mkdtemp()
        self.trail_file = Path(self.folder) / "trail"
        self.trail_file.touch()
        self.key = secrets.token_bytes(16)
        self.door = socket.create_server(("127.0.0.1", 0))
        self.door.settimeout(LOOK)
        words = map(str, (self.door.getsockname()[1], self.trail_file, self.memory))
        self.process = subprocess.Popen(
            [*python(WORK), *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env=os.environ | {"PYTHONPATH": path_of_this(), KEY: self.key.hex()},
            **system.own_group(),
        )
        assert self.process.stdout is not None
        self.pipe = self.process.stdout
        self.reader = threading.Thread(target=self.read_all, daemon=True)
        self.reader.start()

    def connect(self) -> None:
        """Wait until the process has connected.

        Raises:
            TimeoutError: not within `STARTING` s. EOFError: it died.
        """
        end = monotonic() + STARTING
        while not hasattr(self, "connection"):
            if self.process.poll() is not None:
                raise EOFError
            if monotonic() > end:
                raise TimeoutError
            with suppress(TimeoutError, EOFError):
                line, _ = self.door.accept()
                line.settimeout(None)
                connection = Connection(line.detach())
                if connection.poll(1.0) and connection.recv_bytes() == self.key:
                    self.connection = connection

    def answer(self, timeout: float) -> bytes:
        """The next message of the worker. Raises `TimeoutError`, or `EOFError` if it died."""
        if not self.connection.poll(max(0.0, timeout)):
            raise TimeoutError
        return self.connection.recv_bytes()

    def read_all(self) -> None:
        """In a thread: keep the end of the output of the process."""
        with suppress(OSError, ValueError):  # closed
            while new := os.read(self.pipe.fileno(), PRINTED):
                self.printed = (self.printed + new)[-PRINTED:]

    def drain(self, seconds: float) -> None:
        """Wait at most `seconds` until the thread has read all output of the process."""
        self.reader.join(min(seconds, 1.0))

    def forget_trail(self) -> None:
        """Begin a new trail."""
        os.truncate(self.trail_file, 0)

    def left(self) -> bytes:
        """The trail of the task."""
        return self.trail_file.read_bytes()

    def close(self) -> None:
        """Kill the process and all processes that it has started."""
        self.stopped = True
        system.end_all(self.process.pid)
        self.process.wait()

    def close_channels(self) -> None:
        """Delete the trail, and close the other channels."""
        self.door.close()
        self.pipe.close()
        shutil.rmtree(self.folder, ignore_errors=True)


def main(words: Sequence[str]) -> None:
    """The main function of the process; its arguments are PORT TRAIL MEMORY."""
    port, trail, memory = int(words[0]), words[1], int(words[2])
    line = socket.create_connection(("127.0.0.1", port))
    connection = Connection(line.detach())
    connection.send_bytes(bytes.fromhex(os.environ.pop(KEY)))
    worker_process.work(
        connection, os.open(trail, os.O_WRONLY | os.O_APPEND | system.BINARY), memory
    )
