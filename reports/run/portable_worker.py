"""A worker process where none can be handed open files (macOS, Windows): it connects over the
loopback address, its trail is a file with a name, and a thread reads what it prints."""

from __future__ import annotations

import os
import secrets
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from time import monotonic

from adapters import system
from adapters.safe_path import path_of_this, python
from reports.run import worker_process
from reports.run.worker import PRINTED, STARTING, Worker
from reports.terminal.foreign_text import legible

WORK = "from reports.run.portable_worker import main; main(sys.argv[1:])"
KEY = "CROSSCHECK_WORKER"  # the variable with what a process says to be known as ours
LOOK = 0.05  # s between two looks at whether a process that has not connected still lives


class PortableWorker(Worker):
    """As `Worker`, by other channels."""

    def start(self) -> None:
        """Start the process, which will connect."""
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
        """Wait for the process to connect, if it has not.

        Raises:
            TimeoutError: it has not in `STARTING` s.
            EOFError: it died.
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
        """In a thread: keep the end of what the process prints."""
        with suppress(OSError, ValueError):  # closed
            while new := os.read(self.pipe.fileno(), PRINTED):
                self.printed = (self.printed + new)[-PRINTED:]
                if self.show:
                    sys.stderr.write(legible(new.decode(errors="replace")))

    def hear(self, seconds: float) -> None:
        """Let the thread come to the end of what the process printed, for at most so many s."""
        self.reader.join(min(seconds, 1.0))

    def forget_trail(self) -> None:
        """Begin a new trail."""
        os.truncate(self.trail_file, 0)

    def left(self) -> bytes:
        """The trail of the task."""
        return self.trail_file.read_bytes()

    def close(self) -> None:
        """Kill the process, whatever it is doing, and all that it has started."""
        self.stopped = True
        system.end_all(self.process.pid)
        self.process.wait()

    def close_channels(self) -> None:
        """Delete the trail, and close the rest."""
        self.door.close()
        self.pipe.close()
        shutil.rmtree(self.folder, ignore_errors=True)


def main(words: Sequence[str]) -> None:
    """What the process does; its words are PORT TRAIL MEMORY."""
    port, trail, memory = int(words[0]), words[1], int(words[2])
    line = socket.create_connection(("127.0.0.1", port))
    connection = Connection(line.detach())
    connection.send_bytes(bytes.fromhex(os.environ.pop(KEY)))
    worker_process.work(
        connection, os.open(trail, os.O_WRONLY | os.O_APPEND | system.BINARY), memory
    )
