"""The process in which a solver's file runs: bounded memory, no output, one JSON line in and one
out per request.

It runs with the rights of the user who started it: the limits are against accidents, not against
malice.
"""

from __future__ import annotations

import os
import pickle
import queue
import sys
from itertools import takewhile
from json import dumps, loads  # as they are before a solver may replace them
from pathlib import Path
from threading import Thread
from typing import IO, Any

from adapters import system
from adapters.own_solver.file import SolverFailed

HERE = "here"  # what is said before anything of the solver is in this process
# bytes of data; V8 sets aside far more addresses than it uses, so that these cannot be bounded
MEMORY = 2 * 2**30


def main() -> None:
    """Load the text that a line holds, say what it has, then answer request by request until the
    next text comes or the input ends."""
    stream, answers = private_pipes()
    requests: queue.SimpleQueue[str] = queue.SimpleQueue()
    Thread(target=listen, args=(stream, requests), daemon=True).start()
    system.limit_memory(MEMORY)
    system.write_no_core()
    tell(answers, HERE)
    text, solver = "", None
    while True:
        line = loads(requests.get())
        if isinstance(line, list):
            tell(answers, reply(solver, line))
            continue
        try:
            solver = loaded(line, text, solver)
        except SolverFailed as failure:
            tell(answers, {"failed": vars(failure)})
            return
        text = line
        has = {"functions": solver.functions, "surface": solver.surface}
        tell(answers, has | {"versions": solver.versions()})


def private_pipes() -> tuple[IO[str], IO[str]]:
    """The two ends of the talk with the parent; what the solver prints or reads goes nowhere."""
    requests, answers = (
        os.fdopen(os.dup(0), encoding="utf-8"),
        os.fdopen(os.dup(1), "w", encoding="utf-8"),
    )
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(nowhere, stream)
    return requests, answers


def listen(stream: IO[str], requests: queue.SimpleQueue[str]) -> None:
    """Hand on the lines of the parent; at their end, when nobody is left who could ask, end this
    process and all that the file has started, whatever it is doing."""
    for line in stream:
        requests.put(line)
    system.end_all(os.getpid())


def loaded(line: str, before: str, solver: Any) -> Any:
    """The solver that a line holds, with nothing in it of the one `before`; raises
    `SolverFailed`."""
    if solver is not None and line == before:
        solver.renew()
        return solver
    if solver is not None:
        solver.close()
    return load(*pickle.loads(bytes.fromhex(line)))


def load(solver: Any, copies: Path | None) -> Any:
    """The solver by its kind, its texts kept in `copies`, or the engine of a package or of a file;
    raises `SolverFailed`."""
    if solver.kind == "packaged":
        return solver.load()
    if solver.engine:
        return solver.load(copies)
    if solver.kind == "javascript":
        from adapters.own_solver.javascript import JavaScriptSolver

        return JavaScriptSolver(solver)
    from adapters.own_solver.python import PythonSolver

    return PythonSolver(solver, copies)


def reply(solver: Any, request: list[tuple[str, Any, float]]) -> list[dict[str, Any]]:
    """An answer for every (command, argument, limit s) of a request; one that fails does not stop
    the others.

    After a call that did not come back, no question is put that would make the same call again.
    """
    answers: list[dict[str, Any]] = []
    endless: dict[str, dict[str, Any]] = {}
    alone = -1  # the question that stopped those after it
    while len(answers) < len(request):
        k = len(answers)
        if k != alone and not endless and (questions := questions_at(request, k, solver)):
            answers += solver.together(questions, request[k][2])
            alone = len(answers)
            continue
        command, argument, limit = request[k]
        calls = [call[0] for call in argument["calls"]] if command == "ask" else []
        known = next((endless[call] for call in calls if call in endless), None)
        try:
            answers.append(
                {"failed": known} if known else {"done": done_by(solver, command, argument, limit)}
            )
        except SolverFailed as failure:
            answers.append({"failed": vars(failure)})
            if failure.kind in ("timeout", "memory"):
                endless |= dict.fromkeys([*calls, "step"], vars(failure))
    return answers


def questions_at(request: list[tuple[str, Any, float]], k: int, solver: Any) -> list[Any]:
    """The questions from number k on that can be put together, if the solver takes several."""
    if not hasattr(solver, "together"):
        return []
    alike = takewhile(lambda each: (each[0], each[2]) == ("ask", request[k][2]), request[k:])
    questions = [argument for _, argument, _ in alike]
    return questions if len(questions) > 1 else []


def done_by(solver: Any, command: str, argument: Any, limit: float) -> Any:
    """What a command gives; raises `SolverFailed`."""
    return solver.renew() if command == "renew" else solver.run(command, argument, limit)


def tell(answers: IO[str], what: Any) -> None:
    """One line to the parent."""
    answers.write(dumps(what) + "\n")
    answers.flush()


def work() -> None:
    """All that the process does."""
    sys.dont_write_bytecode = True
    try:
        main()
    finally:
        # Without Python's own end: taking down a V8 that was stopped in an endless loop never
        # returns.
        os._exit(0)
