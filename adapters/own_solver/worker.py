"""The process in which a solver's file runs: bounded memory, no output, one JSON line in and one
out per request.

It has the rights of the user: the limits protect against accidents, not against malice.
"""

from __future__ import annotations

import os
import pickle
import queue
import sys
from itertools import takewhile
from json import dumps, loads  # before a solver can replace them
from pathlib import Path
from threading import Thread
from typing import IO, Any

from crosscheck2d.adapters import system
from crosscheck2d.adapters.own_solver.file import SolverFailed

HERE = "here"  # the first line, before the solver is loaded
# bytes of data; the address space cannot be limited, because V8 reserves far more than it uses
MEMORY = 2 * 2**30


def main() -> None:
    """Load the text in a line, report its functions, then answer requests until the next text or
    the end of the input."""
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
    """The two pipes to the parent; output and input of the solver itself are discarded."""
    requests, answers = (
        os.fdopen(os.dup(0), encoding="utf-8"),
        os.fdopen(os.dup(1), "w", encoding="utf-8"),
    )
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(nowhere, stream)
    return requests, answers


def listen(stream: IO[str], requests: queue.SimpleQueue[str]) -> None:
    """Pass on the lines of the parent; when the parent has closed the pipe, end this process and
    all its children."""
    for line in stream:
        requests.put(line)
    system.end_all(os.getpid())


def loaded(line: str, before: str, solver: Any) -> Any:
    """The solver in a line, without any state of the one `before`; raises `SolverFailed`."""
    if solver is not None and line == before:
        solver.renew()
        return solver
    if solver is not None:
        solver.close()
    return load(*pickle.loads(bytes.fromhex(line)))


def load(solver: Any, copies: Path | None) -> Any:
    """The solver of the right kind, with its texts in `copies`, or the engine of a package or a
    file; raises `SolverFailed`."""
    if solver.kind == "packaged":
        return solver.load()
    if solver.engine:
        return solver.load(copies)
    if solver.kind == "javascript":
        from crosscheck2d.adapters.own_solver.javascript import JavaScriptSolver

        return JavaScriptSolver(solver)
    from crosscheck2d.adapters.own_solver.python import PythonSolver

    return PythonSolver(solver, copies)


def reply(solver: Any, request: list[tuple[str, Any, float]]) -> list[dict[str, Any]]:
    """An answer for every (command, argument, limit s) of a request; one that fails does not stop
    the others.

    After a call that did not return, no question with the same call is asked.
    """
    answers: list[dict[str, Any]] = []
    endless: dict[str, dict[str, Any]] = {}
    alone = -1  # the question that stopped those after it
    while len(answers) < len(request):
        k = len(answers)
        if k != alone and not endless and (questions := questions_at(request, k, solver)):
            answers += solver.together(questions, request[k][2] * TOGETHER)
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


# of the time of a question: all together take a few milliseconds, or one of them is asked again
TOGETHER = 0.2


def questions_at(request: list[tuple[str, Any, float]], k: int, solver: Any) -> list[Any]:
    """The questions from number k on that can be asked together, if the solver takes several."""
    if not hasattr(solver, "together"):
        return []
    alike = takewhile(lambda each: (each[0], each[2]) == ("ask", request[k][2]), request[k:])
    questions = [argument for _, argument, _ in alike]
    return questions if len(questions) > 1 else []


def done_by(solver: Any, command: str, argument: Any, limit: float) -> Any:
    """The result of a command; raises `SolverFailed`."""
    return solver.renew() if command == "renew" else solver.run(command, argument, limit)


def tell(answers: IO[str], what: Any) -> None:
    """One line to the parent."""
    answers.write(dumps(what) + "\n")
    answers.flush()


def work() -> None:
    """The main function of the process."""
    sys.dont_write_bytecode = True
    try:
        main()
    finally:
        # Without Python's own end: taking down a V8 that was stopped in an endless loop never
        # returns.
        os._exit(0)
