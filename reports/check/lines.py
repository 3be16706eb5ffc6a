"""Finds the lines of a solver's file that a row is about, with spheres that record the line of each
read and write of their numbers."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from adapters.own_solver.process import SolverProcess
from adapters.own_solver.restitution import code_of
from reports.check.functions import CHANGED
from reports.check.impacts import APPROACH, AS_IF_EQUAL
from reports.check.questions import QUESTIONS, Question, fresh_world
from reports.check.rows import SAME_AGAIN, UNKNOWN, CheckRow

LIMIT = 0.2  # s a traced call may take: the first accesses are enough for one that never returns
# task -> the question that is traced
SHOWN = {"1": "force", "2": "collision/light on heavy"}
MOST = 5  # lines in a row
LONGEST = 160  # characters of a line; a minified file is a single line


class Access(NamedTuple):
    """A read or a write of a number of a sphere.

    Attributes:
        kind: "r" or "w".
        sphere: its index in the question. field: of the sphere; "position" for both x and y.
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
    if not failed_at and repeated(seen) == "position":
        return "2b"
    displaced = max((k for k, a in enumerate(seen) if is_write(a, "position")), default=-1)
    before = [a for a in seen[displaced + 1 :] if not failed_at or a.line != failed_at]
    if all((who, field) in {(a.sphere, a.field) for a in before} for who, field in FOR_IMPULSE):
        return "2d"  # everything that the impulse needs has been read
    if displaced >= 0 or any(a.field == "velocity" for a in seen):
        return "2c"
    return "2b" if {(a.sphere, a.field) for a in before} >= FOR_DISTANCE else "2a"


# sphere.velocity.x = ..., sphere["velocity"]["x"] += ..., [a.velocity.x, a.velocity.y] = ...
ASSIGNED = r"""["']?\]?(?:\.[xy]|\[["']?[xy01]["']?\])?\s*\]?\s*[-+*/]?=(?!=)"""
WRITES_VELOCITY = re.compile(rf"\bvelocity{ASSIGNED}")
WRITES_POSITION = re.compile(rf"\bposition{ASSIGNED}")
FOR_IMPULSE = {(who, field) for who in (0, 1) for field in ("velocity", "mass")}
FOR_DISTANCE = {(who, field) for who in (0, 1) for field in ("position", "size")}


def repeated(seen: Sequence[Access]) -> str:
    """The field that an endless call reads or writes repeatedly; "" if there is none."""
    again = seen[-1:] and sum(access.line == seen[-1].line for access in seen) > LOOPS
    return seen[-1].field if again else ""


LOOPS = 40  # accesses from one line; a right call needs a dozen


def is_write(access: Access, field: str) -> bool:
    """Whether the access writes this field."""
    return (access.kind, access.field) == ("w", field)


def any_write(seen: Iterable[Access], field: str) -> bool:
    """Whether one of the accesses writes this field."""
    return any(is_write(access, field) for access in seen)


# row of task 1 -> the fields that it judges
WRITTEN = {
    "velocity": ("velocity",),
    "position": ("position",),
    "spin": ("angularVelocity",),
    "angle": ("alpha",),
    "turns": ("alpha",),
    "coasting": ("velocity", "angularVelocity"),
    "force kept": ("force", "torque"),
    "sphere kept": ("mass", "MoI", "size"),
    "rest kept": ("force", "alpha", "angularVelocity", "torque", "mass", "MoI", "size"),
    "velocity of A": ("velocity",),
    "velocity of B": ("velocity",),
}
# row of the step -> the function that performSimStep calls on the lines in question
CALLED = {
    "all spheres": "integrate",
    "pairs": "sphereSphereCollisionHandling",
    "itself": "sphereSphereCollisionHandling",
    "integration first": "sphereSphereCollisionHandling",
    "edges in a step": "projectObjects",
}


# causes on the lines that compute the normal of a pair, and those that name it but are elsewhere
ABOUT_NORMAL = re.compile(r"\bnormal\b|\bd[xy] is")
SIGN_OF_J = "sign of the normal or of J"
ONE_PLACE = "in one of its two places"
AFTER = "after the displacement"
NO_MASSES = "the masses are missing"
ABOUT_OTHERS = re.compile(r"velocit|normal part|overlap|sum of the sizes")
GUARD = re.compile(r"==\s*0\b")  # two at the same place
HEAD_OF_LOOP = re.compile(r"\b(?:for|while|do|forEach|map)\b")
BRANCH = re.compile(r"\bif\b.*[<>]|[<>].*\?")  # on the order of two numbers
ASSIGNS = re.compile(r"([\w.,\s\[\]]+?)\s*[-+*/]?=(?![=>])")


def assigned(statement: str) -> list[str]:
    """The variables that a line of code sets: nx of "var nx = ...", nx and ny of "nx, ny = ..."."""
    sides = (found[1].replace("var ", "") for found in ASSIGNS.finditer(statement))
    return [name for side in sides for name in re.findall(r"\w+(?=\s*(?:,|\]|$))", side)]


def detection_lines(seen: Sequence[Access]) -> list[int]:
    """The lines that first read the size of either sphere, before any write."""
    first_write = next((k for k, a in enumerate(seen) if a.kind == "w"), len(seen))
    sizes = [a for a in seen[:first_write] if a.field == "size"]
    both = next((k + 1 for k, a in enumerate(sizes) if a.sphere != sizes[0].sphere), 1)
    return [a.line for a in sizes[:both]]


def distance_lines(seen: Sequence[Access]) -> list[int]:
    """The lines that read positions before any write, with those of the helpers that do it."""
    first_write = next((k for k, a in enumerate(seen) if a.kind == "w"), len(seen))
    written = {a.line for a in seen if a.kind == "w"}
    reads = [a for a in seen[:first_write] if a.field == "position" and a.line not in written]
    return [line for a in reads for line in (*a.helpers, a.line)]


def calls_for_one(writes: Sequence[Access], of_it: Sequence[Access]) -> list[int]:
    """The lines that call, for one sphere, a function whose lines write both."""
    callers: dict[int, set[Sequence[int]]] = {}
    for a in writes:
        callers.setdefault(a.line, set()).add(tuple(a.lines[1:2]))
    return [a.lines[1] for a in of_it if len(callers[a.line]) > 1 and len(a.lines) > 1]


def displacement_lines(seen: Sequence[Access], cause: str) -> list[int]:
    """The lines that write positions, of both spheres or of the one at fault. If the cause is in
    the overlap, the line that computes it comes first: the last that reads sizes."""
    who = re.match(r"(?:only )?([AB])\b", cause)
    spheres = {"AB".index(who[1])} if who else {0, 1}
    writes = [a.line for a in seen if is_write(a, "position") and a.sphere in spheres]
    overlap = [a.line for a in seen if a.field == "size" and a.line not in writes][-1:]
    return [*(overlap if re.search(r"size|overlap|bracket", cause) else []), *writes]


def impulse_lines(seen: Sequence[Access], cause: str) -> list[int]:
    """The lines that compute the impulse: those that read velocities or masses, depending on the
    cause. If there are none, the lines that write velocities."""
    displaced = max((k for k, a in enumerate(seen) if is_write(a, "position")), default=-1)
    moving = {a.line for a in seen if is_write(a, "position")}
    writes = [a.line for a in seen if is_write(a, "velocity")]
    about: tuple[str, ...] = ("velocity", "mass")
    if re.search(r"velocit|scalar product|relative", cause):
        about = ("velocity",)
    elif re.search(r"mass|m[AB]|\be is|bracket|\(1 [+-] e\)|e = ", cause):
        about = ("mass",)
    for fields in (about, ("velocity", "mass")):
        for after in (seen[displaced + 1 :], seen):
            used = [a.line for a in after if a.kind == "r" and a.field in fields]
            if found := [line for line in used if line not in {*writes, *moving}]:
                return found
    return writes


NAMED = re.compile(r"\(line (\d+)\b|\bline (\d+) has\b")


def named_line(cause: str, text: str) -> list[tuple[int, str]]:
    """The line of a file's text that a cause names, with its number from 1; none if it names
    none."""
    named, lines = NAMED.search(cause), text.splitlines()
    number = int(named[1] or named[2]) if named else 0
    return [(number, cut(lines[number - 1].strip()))] if 0 < number <= len(lines) else []


def cut(line: str) -> str:
    """A line of at most `LONGEST` characters."""
    return line if len(line) <= LONGEST else f"{line[: LONGEST - 4]} ..."


class Source:
    """The text of a file, and the accesses of its two functions, traced when needed.

    Its methods raise `SolverFailed` if the process is lost.
    """

    def __init__(self, process: SolverProcess, text: str) -> None:
        self.process, self.text, self.lines = process, text, text.splitlines()
        self.traced: dict[str, list[Access]] = {}

    def accesses(self, question: str) -> list[Access]:
        """The accesses that a question causes; none if the file lacks the function."""
        needed = QUESTIONS[question].calls[0][0]
        if question not in self.traced:
            has = self.process.functions[needed]
            found = accesses_of(self.process, QUESTIONS[question], self.text) if has else []
            self.traced[question] = found
        return self.traced[question]

    def part_of(self, question: str, failed_at: int) -> str:
        """The part of task 2 in which the call of a question failed, at the line `failed_at`."""
        return part_of(self.accesses(question), failed_at, self.text)

    def of(self, row: CheckRow) -> list[tuple[int, str]]:
        """The lines that a row is about, at most `MOST`, each with its number from 1."""
        if named := named_line(row.cause, self.text):
            # What performSimStep calls fails by what it is called with: that is at its loops.
            numbers = [named[0][0], *(self.loops() if row.task == "loop" else [])]
        elif row.task == "loop":
            numbers = self.calls(row.name)
        elif "does not come back" in row.cause:
            numbers = self.endless_lines(self.accesses(SHOWN["1" if row.task == "1" else "2"]))
        elif row.name == SAME_AGAIN:
            numbers = self.assignment_lines(re.findall(r"global (\w+)", row.cause))
        else:
            numbers = self.access_lines(row)
        shown = sorted([k for k in dict.fromkeys(numbers) if k][:MOST])
        return [(k, cut(self.lines[k - 1].strip())) for k in shown if k <= len(self.lines)]

    def access_lines(self, row: CheckRow) -> list[int]:
        """The lines that read or write the numbers that a row of the two tasks judges."""
        seen = self.accesses(SHOWN["1" if row.task == "1" else "2"])
        if row.name in WRITTEN:
            who = {"velocity of A": {0}, "velocity of B": {1}}.get(row.name, {0, 1})
            writes = [a for a in seen if a.kind == "w" and a.field in WRITTEN[row.name]]
            # Where one sphere is not written at all, its lines belong beside those of the other.
            of_it = [a for a in writes if a.sphere in who] or writes
            return [*calls_for_one(writes, of_it), *(a.line for a in of_it)]
        made = self.normal_lines(seen, row.cause)
        if row.task == "2a":
            sizes = detection_lines(seen)
            if row.cause == UNKNOWN:
                return [*distance_lines(seen), *sizes, *self.branches(sizes)]
            return [*made, *sizes, *(self.branches(sizes) if "compar" in row.cause else [])]
        if row.task == "2b":
            return made or displacement_lines(seen, row.cause)
        if row.task == "2c" and SIGN_OF_J in row.cause:
            # The displacement has the same normal, and is judged by itself: J comes first.
            return [
                *impulse_lines(seen, "mass"),
                *(a.line for a in seen if is_write(a, "velocity")),
            ]
        if row.task == "2c" and ONE_PLACE in row.cause:
            return [
                *impulse_lines(seen, "velocities"),
                *(a.line for a in seen if is_write(a, "velocity")),
            ]
        if row.task == "2c" and row.cause.startswith(AS_IF_EQUAL):
            return [*self.lines_of_j(seen), *(a.line for a in seen if is_write(a, "velocity"))]
        if row.task == "2c" and row.cause == APPROACH:
            velocities = [a.line for a in seen if a.field == "velocity"]
            return self.branches(velocities) or impulse_lines(seen, row.cause)
        if row.task == "2c" and NO_MASSES in row.cause:
            return self.lines_of_j(seen) or impulse_lines(seen, row.cause)
        if row.task == "2c":
            return made or impulse_lines(seen, row.cause)
        return [a.line for a in seen if is_write(a, "velocity")] if row.task == "2d" else []

    def branches(self, lines: Sequence[int]) -> list[int]:
        """The first line from the last of these on that compares two numbers in a condition."""
        last = max(lines, default=0)
        code = code_of(self.text).splitlines()
        after = range(last, min(last + MOST, len(code)) + 1) if last else ()
        return [k for k in after if BRANCH.search(code[k - 1])][:1]

    def endless_lines(self, seen: Sequence[Access]) -> list[int]:
        """The head of the loop that a call does not leave, and the lines in it that are known."""
        if not seen:
            return []
        code = code_of(self.text).splitlines()
        # The call was stopped anywhere: its latest access is not the same every time.
        body = sorted({a.line for a in seen[-LOOPS:-1]}) if repeated(seen) else []
        ahead = range(seen[-1].line, len(code) + 1)
        around = range(body[0] if body else 0, 0, -1)
        heads = (k for k in (around or ahead) if k and HEAD_OF_LOOP.search(code[k - 1]))
        return [next(heads, seen[-1].line), *body]

    def lines_of_j(self, seen: Sequence[Access]) -> list[int]:
        """The lines that set a variable after the last that reads a velocity, up to the first that
        writes one: those of J, if it reads no number of a sphere."""
        writes = [a.line for a in seen if is_write(a, "velocity")]
        reads = [a.line for a in seen if a.field == "velocity" and a.line not in writes]
        if not (reads and writes):
            return []
        code = code_of(self.text).splitlines()
        return [k for k in range(max(reads) + 1, min(writes)) if assigned(code[k - 1])]

    def normal_lines(self, seen: Sequence[Access], cause: str) -> list[int]:
        """The lines that compute the normal or the distance, if the cause is about these.

        They are lines that read positions and write none; later lines that change the result before
        a velocity is written; and for the distance lines that use it before any write.
        """
        if ABOUT_OTHERS.search(cause) or not (ABOUT_NORMAL.search(cause) or "square" in cause):
            return []
        code = code_of(self.text).splitlines()
        written = {a.line for a in seen if a.kind == "w"}
        first_write = next((k for k, a in enumerate(seen) if a.kind == "w"), len(seen))
        displaced = max((k for k, a in enumerate(seen) if is_write(a, "position")), default=-1)
        before, after = (
            [
                line
                for line in dict.fromkeys(a.line for a in part if a.field == "position")
                if line and line not in written
            ]
            for part in (seen[:first_write], seen[displaced + 1 :])
        )
        reads = (after if AFTER in cause else []) or before
        if not reads:
            return []
        made = {name for line in reads for name in assigned(code[line - 1])}
        kicks = [a.line for a in seen if is_write(a, "velocity") and a.line > max(reads)]
        between = [
            k
            for k in range(max(reads) + 1, min(kicks, default=max(reads) + 1))
            if k not in written and not code[k - 1].lstrip().startswith("if")
        ]
        changes = [k for k in between if made & {*assigned(code[k - 1])}]
        if ABOUT_NORMAL.search(cause):
            return [*reads, *changes] if len(reads + changes) <= MOST else [*changes, *reads]
        used = rf"\b(?:{'|'.join(made)})\b"
        sums = [k for k in range(max(reads) + 1, max(reads) + 5) if k - 1 < len(code)]
        sums = [k for k in sums if k not in changes and not GUARD.search(code[k - 1])]
        return [k for k in sums if made and re.search(used, code[k - 1])][:2]

    def calls(self, name: str) -> list[int]:
        """The lines of performSimStep that a row of the step is about; for a row about the edges
        the head of projectObjects."""
        if name not in CALLED:
            return self.heads("projectObjects" if name in ("edges", "ufo") else "performSimStep")
        code, function = code_of(self.text).splitlines(), CALLED[name]
        begin = next(iter(self.heads("performSimStep")), 0)
        found = [
            k
            for k, line in enumerate(code[begin:], begin + 1)
            if re.search(rf"\b{function}\s*\(", line) and k not in self.heads(function)
        ]
        if found and name == "itself":  # the loop over j stands last, its head before the call
            return [found[-1] - 1, found[-1]]
        return found or self.heads("performSimStep")

    def loops(self) -> list[int]:
        """The lines of performSimStep that collide pairs, and the heads of their loops."""
        code = code_of(self.text).splitlines()
        begin = next(iter(self.heads("performSimStep")), 0)
        calls = [k for k in self.calls("pairs") if k > begin]
        heads = [
            next((k for k in range(call, begin, -1) if HEAD_OF_LOOP.search(code[k - 1])), 0)
            for call in calls
        ]
        return [*heads, *calls]

    def heads(self, function: str) -> list[int]:
        """The lines where a function is defined."""
        head = re.compile(rf"\b(?:function|def|const|let|var)\s+{function}\b")
        return [k for k, line in enumerate(self.lines, 1) if head.search(line)]

    def assignment_lines(self, names: Sequence[str]) -> list[int]:
        """The lines that change one of these variables."""
        change = re.compile(rf"\b(?:{'|'.join(names)}){CHANGED}")
        code = code_of(self.text).splitlines()
        return [k for k, line in enumerate(code, 1) if names and change.search(line)]
