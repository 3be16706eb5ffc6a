"""An adapter of this program in a process of its own, in which another version of its library is
imported: `pymunk@6.8.1`."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from crosscheck2d.adapters import system
from crosscheck2d.adapters.engine import NotLoaded
from crosscheck2d.adapters.host.file import SolverFailed
from crosscheck2d.adapters.host.process import end
from crosscheck2d.adapters.library_at_version import LibraryAtVersion, NotInstalled
from crosscheck2d.adapters.library_versions import BOX2D
from crosscheck2d.adapters.safe_path import python
from crosscheck2d.scenarios.model import Array, Scene

# (this process, folder) -> a process that waits for the next engine; it ends with this one
waiting: dict[tuple[int, Path], subprocess.Popen[bytes]] = {}


class EngineApart:
    """The engine of `place`, "module.Class", made with `arguments` and `settings`.

    It is the same code as in this process, so what it raises is raised here. It is as trusted as
    any installed package: the process is no sandbox.
    """

    listening, wrapping = True, 0.0

    def __init__(
        self, library: LibraryAtVersion, place: str, *arguments: Any, **settings: Any
    ) -> None:
        self.name = f"{library.package} {library.version}"
        self.library, self.made = library, (place, arguments, settings)
        self.process: subprocess.Popen[bytes] | None = None
        self.calls: list[tuple[Any, ...]] = []  # without a result, made before the next

    def load(self, scene: Scene, dt: float) -> None:
        if self.process is None:
            self.start()
            self.ask("make", *self.made)
        self.calls.clear()
        self.ask("load", scene, dt, self.listening)

    def start(self) -> None:
        try:
            folder = self.library.checked()
        except NotInstalled as reason:
            raise NotLoaded(f"{self.name}: {reason}") from None
        self.process = waiting.pop((os.getpid(), folder), None)
        if self.process is not None and self.process.poll() is None:
            return
        self.process = subprocess.Popen(
            python(f"from {__name__} import serve; serve({str(folder)!r})"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )

    def ask(self, *call: Any) -> Any:
        process, calls = self.process, [*self.calls, call]
        self.process = None  # until there is an answer: one that is interrupted is not used again
        self.calls.clear()
        assert process is not None
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            pickle.dump(calls, process.stdin)
            process.stdin.flush()
            result, raised = pickle.load(process.stdout)
        except (EOFError, OSError):
            end(process)
            what = f"the process of {self.name} ended (exit status {process.returncode})"
            raise SolverFailed("crashed", what) from None
        except BaseException:
            end(process)
            raise
        self.process = process
        if raised is not None:
            raise raised
        return result

    def apply_force(self, disk: int, force: Array, torque: float) -> None:
        self.calls.append(("apply_force", disk, force, torque))

    def step(self, count: int = 1) -> None:
        self.wrapping += self.ask("step", count)

    def __getattr__(self, verb: str) -> Any:
        if verb not in ("read", "collisions", "settings"):
            raise AttributeError(verb)
        return partial(self.ask, verb)

    def versions(self) -> dict[str, str]:
        versions: dict[str, str] = self.ask("versions")
        versions.pop(BOX2D, None)  # of the distribution that is installed
        return versions | self.library.versions

    def close(self) -> None:
        if self.process is not None:
            key = os.getpid(), self.library.folder
            if before := waiting.pop(key, None):
                end(before)
            waiting[key] = self.process
            self.process = None


def serve(folder: str) -> None:
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # a library may write to it
    system.end_with_parent()
    sys.path.insert(0, folder)
    engine: Any = None
    while True:
        try:
            calls = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        result, raised = None, None
        try:
            for verb, *arguments in calls:
                if verb == "make":
                    place, given, settings = arguments
                    module, _, name = place.rpartition(".")
                    engine = getattr(import_module(module), name)(*given, **settings)
                    continue
                if verb == "load":
                    engine.listening = arguments.pop()
                engine.wrapping = 0.0
                result = getattr(engine, verb)(*arguments)
                result = engine.wrapping if verb == "step" else result
        except Exception as error:
            raised = error
        pickle.dump((result, raised), answers)
        answers.flush()
