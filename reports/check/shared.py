"""The functions of a file that its wrong tasks share: a mistake in one shows in several tasks."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from adapters.own_solver.restitution import code_of
from reports.check.functions import FUNCTIONS
from reports.check.rows import UNKNOWN, CheckRow

DEFINED = re.compile(
    r"^([ \t]*)(?:(?:function|def)\s+(\w+)"
    r"|(?:const|let|var)\s+(\w+)\s*=\s*(?:function\b|\([^()]*\)\s*=>|\w+\s*=>))",
    re.MULTILINE,
)


class FunctionText(NamedTuple):
    """A function in a file: the line on which it begins, and its code after its name."""

    line: int
    code: str


def shared_functions(rows: Sequence[CheckRow], text: str) -> str:
    """A sentence with the functions of the file's own, and their lines, that all tasks with a
    fault call, and no right task; "" if there are none, or if the faults have causes of their own.

    Parts of task 2 are taken to share a mistake if the cause of the first of them is unknown;
    tasks 1 and 2 if both have a fault.
    """
    faults = [row for row in rows if row.verdict == "fault" and row.task[0] in "12"]
    unknown = any(row.cause == UNKNOWN for row in faults if row.task != "1")
    wrong = {row.task for row in faults}
    if len(wrong) < 2 or not (unknown or "1" in wrong):
        return ""
    functions = functions_in(text)
    called = {number: reached(functions, FUNCTIONS[task]) for number, task in TOP.items()}
    faulty = {task[0] for task in wrong}
    shared = set.intersection(*(called[number] for number in faulty))
    shared -= set().union(*(called[number] for number in {*TOP} - faulty))
    places = sorted((functions[name].line, name) for name in shared - {*FUNCTIONS.values()})
    if not places:
        return ""
    said = ", ".join(f"{name} (line {line})" for line, name in places)
    return f"One mistake may be behind these faults, in a function that they share: {said}."


TOP = {"1": "1", "2": "2a"}  # task -> its part of which `FUNCTIONS` has the function


def functions_in(text: str) -> dict[str, FunctionText]:
    """The functions that a file defines, by name. One ends where the next begins that is not
    indented more."""
    code = code_of(text)
    heads = [*DEFINED.finditer(code)]
    found: dict[str, FunctionText] = {}
    for k, head in enumerate(heads):
        after = (one.start() for one in heads[k + 1 :] if len(one[1]) <= len(head[1]))
        line = code.count("\n", 0, head.start()) + 1
        found[head[2] or head[3]] = FunctionText(line, code[head.end() : next(after, len(code))])
    return found


def reached(functions: Mapping[str, FunctionText], start: str) -> set[str]:
    """The functions that one calls, and those that these call."""
    found: set[str] = set()
    waiting = [start] if start in functions else []
    while waiting:
        code = functions[waiting.pop()].code
        new = {name for name in functions if re.search(rf"\b{name}\s*\(", code)} - found
        found |= new
        waiting += new
    return found
