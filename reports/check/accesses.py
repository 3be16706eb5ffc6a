"""What a call of a solver's function reads and writes, in order, and from which lines: its spheres
record it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from crosscheck2d.adapters.own_solver.process import SolverProcess
from crosscheck2d.adapters.own_solver.restitution import code_of
from crosscheck2d.reports.check.questions import Question, fresh_world

LIMIT = 0.2  # s a traced call may take: the first accesses are enough for one that never returns


class Access(NamedTuple):
    """A read or a write of a number of a sphere.

    Attributes:
        kind: "r" or "w".
        sphere: its index in the question.
        field: of the sphere; "position" for both x and y.
        lines: the lines of the file on the call stack, the innermost first, without helpers.
        helpers: the lines of helpers, which take any vector.
    """

    kind: str
    sphere: int
    field: str
    lines: Sequence[int]
    helpers: tuple[int, ...] = ()

    @property
    def line(self) -> int:
        """The line of the access; 0 if it is not known."""
        return self.lines[0] if self.lines else 0


def accesses_of(process: SolverProcess, question: Question, text: str) -> list[Access]:
    """The reads and writes of the calls of a question, in order, in a fresh world, up to a failure
    if there is one; with the lines of the file's text outside helpers. Raises `SolverFailed` if the
    process is lost."""
    if process.surface == "advance":
        return []  # its spheres are arrays, which record nothing
    *_, seen = process.request(
        [
            *fresh_world(process),
            ("trace", question.request, LIMIT),
            ("accesses", None, LIMIT),
        ]
    )
    code = code_of(text).splitlines()
    return outside_helpers(
        [
            Access(kind, sphere, field, [line for line in lines if line <= len(code)])
            for kind, sphere, field, lines in (seen if isinstance(seen, list) else [])
        ],
        code,
    )


def outside_helpers(seen: list[Access], code: Sequence[str]) -> list[Access]:
    """The accesses without those of helper functions, which get the line of the caller instead.

    A helper takes any vector: the caller's line names the field and its own does not, or one of its
    lines writes both positions and velocities, or reads both in calls from different lines.
    """
    callers: dict[tuple[str, int], dict[str, set[tuple[int, ...]]]] = {}
    for access in seen:
        fields = callers.setdefault((access.kind, access.line), {})
        fields.setdefault(access.field, set()).add(tuple(access.lines[1:]))
    helpers = {
        line
        for (kind, line), fields in callers.items()
        if fields.keys() >= {"position", "velocity"}
        and (kind == "w" or fields["position"].isdisjoint(fields["velocity"]))
    }

    def in_helper(access: Access) -> bool:
        return bool(access.line) and (access.line in helpers or passed_on(access, code))

    if not any(map(in_helper, seen)):
        return seen
    return outside_helpers(
        [
            access._replace(lines=access.lines[1:], helpers=(*access.helpers, access.line))
            if in_helper(access)
            else access
            for access in seen
        ],
        code,
    )


def passed_on(access: Access, code: Sequence[str]) -> bool:
    """Whether the caller's line names the field of an access, and its own line does not."""
    own, caller = (*access.lines, 0, 0)[:2]
    named = re.compile(rf"""[.\["']{access.field}\b""")
    return bool(caller and named.search(code[caller - 1]) and not named.search(code[own - 1]))


def part_of(seen: Sequence[Access], failed_at: int, text: str) -> str:
    """The part of task 2 in which a call failed, judged by its accesses until then.

    failed_at: the line that threw; 0 for a call that never returned.
    """
    statement = text.splitlines()[failed_at - 1] if failed_at else ""
    if WRITES_VELOCITY.search(statement) or any_write(seen, "velocity"):
        return "2d"
    if WRITES_POSITION.search(statement):
        return "2b"
    again = set() if failed_at else repeated(seen)
    if "position" in again and not again & {"velocity", "mass"}:
        return "2b"
    before = [a for a in after_displacement(seen) if not failed_at or a.line != failed_at]
    if all((who, field) in {(a.sphere, a.field) for a in before} for who, field in FOR_IMPULSE):
        return "2d"  # everything that the impulse needs has been read
    if any_write(seen, "position") or any(a.field == "velocity" for a in seen):
        return "2c"
    return "2b" if {(a.sphere, a.field) for a in before} >= FOR_DISTANCE else "2a"


# sphere.velocity.x = ..., sphere["velocity"]["x"] += ..., [a.velocity.x, a.velocity.y] = ...
ASSIGNED = r"""["']?\]?(?:\.[xy]|\[["']?[xy01]["']?\])?\s*\]?\s*[-+*/]?=(?!=)"""
WRITES_VELOCITY = re.compile(rf"\bvelocity{ASSIGNED}")
WRITES_POSITION = re.compile(rf"\bposition{ASSIGNED}")
FOR_IMPULSE = {(who, field) for who in (0, 1) for field in ("velocity", "mass")}
FOR_DISTANCE = {(who, field) for who in (0, 1) for field in ("position", "size")}


def repeated(seen: Sequence[Access]) -> set[str]:
    """The fields that the loop of an endless call reads or writes; none if it repeats nothing.

    The latest access is left out of what is counted: the call was stopped anywhere in its loop.
    """
    times = Counter(access.line for access in seen[:-1])
    return {access.field for access in seen if times[access.line] > LOOPS}


LOOPS = 40  # accesses from one line; a right call needs a dozen


def after_displacement(seen: Sequence[Access]) -> Sequence[Access]:
    """The accesses after the last write of a position; all if there is none."""
    displaced = max((k for k, a in enumerate(seen) if is_write(a, "position")), default=-1)
    return seen[displaced + 1 :]


def is_write(access: Access, field: str) -> bool:
    """Whether the access writes this field."""
    return (access.kind, access.field) == ("w", field)


def any_write(seen: Iterable[Access], field: str) -> bool:
    """Whether one of the accesses writes this field."""
    return any(is_write(access, field) for access in seen)
