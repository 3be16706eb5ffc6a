"""Finds the lines of a solver's file that a row is about, by what its calls read and write."""

from __future__ import annotations

import re
from collections.abc import Sequence

from crosscheck2d.adapters.own_solver.process import SolverProcess
from crosscheck2d.adapters.own_solver.restitution import code_of
from crosscheck2d.reports.check.accesses import (
    LOOPS,
    Access,
    accesses_of,
    after_displacement,
    any_write,
    is_write,
    part_of,
    repeated,
)
from crosscheck2d.reports.check.functions import CHANGED, FUNCTIONS
from crosscheck2d.reports.check.impacts import APPROACH, AS_IF_EQUAL
from crosscheck2d.reports.check.parts import BEFORE
from crosscheck2d.reports.check.questions import QUESTIONS
from crosscheck2d.reports.check.rows import INTEGRATES, SAME_AGAIN, UNKNOWN, CheckRow

# task -> the question that is traced
SHOWN = {"1": "force", "2": "collision/light on heavy"}
MOST = 5  # lines in a row
MOST_UNKNOWN = 8  # in a row whose cause is unknown
LONGEST = 160  # characters of a line; a minified file is a single line
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
    "each pair once": "sphereSphereCollisionHandling",
    "edges last": "projectObjects",
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
DECIDES = re.compile(r"compar|taken to collide")
ONE_SPHERE = re.compile(r"\bv?[AB]\b")
SHARES = re.compile(r"\bshares?\b|\bmoved by .* times\b")  # of the displacement
GUARD = re.compile(r"==\s*0\b")  # two at the same place
HEAD_OF_LOOP = re.compile(r"\b(?:for|while|do|forEach|map)\b")
BRANCH = re.compile(r"\bif\b.*[<>]|[<>].*\?")  # on the order of two numbers
ASSIGNS = re.compile(r"([\w.,\s\[\]]+?)\s*[-+*/]?=(?![=>])")


HEAD_OF_FUNCTION = re.compile(r"^\s*(?:function|def|async|class)\b")
# fields that a normal is not computed from, and those that an impulse is not
NOT_OF_NORMAL = re.compile(r"\bsize\b|\bmass\b|\bvelocity\b")
NOT_OF_IMPULSE = re.compile(r"\bposition\b|\bsize\b")


def names_in(statement: str) -> set[str]:
    """The variables that a line of code names: not what comes after a point."""
    return {*re.findall(r"(?<![\w.])[A-Za-z_]\w*", statement)}


def assigned(statement: str) -> list[str]:
    """The variables that a line of code sets: nx of "var nx = ...", nx and ny of "nx, ny = ..."."""
    sides = (found[1].replace("var ", "") for found in ASSIGNS.finditer(statement))
    return [name for side in sides for name in re.findall(r"\w+(?=\s*(?:,|\]|$))", side)]


def lines_writing(seen: Sequence[Access], field: str) -> list[int]:
    """The line of each write of this field."""
    return [a.line for a in seen if is_write(a, field)]


def before_writes(seen: Sequence[Access]) -> Sequence[Access]:
    """The accesses before the first write."""
    return seen[: next((k for k, a in enumerate(seen) if a.kind == "w"), len(seen))]


def detection_lines(seen: Sequence[Access]) -> list[int]:
    """The lines that first read the size of either sphere, before any write."""
    sizes = [a for a in before_writes(seen) if a.field == "size"]
    both = next((k + 1 for k, a in enumerate(sizes) if a.sphere != sizes[0].sphere), 1)
    return [a.line for a in sizes[:both]]


def distance_lines(seen: Sequence[Access]) -> list[int]:
    """The lines that read positions before any write, with those of the helpers that do it."""
    written = {a.line for a in seen if a.kind == "w"}
    reads = [a for a in before_writes(seen) if a.field == "position" and a.line not in written]
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


def first_writes(seen: Sequence[Access], writes: Sequence[Access]) -> list[int]:
    """The lines of those writes of velocities that come before the last line that only reads
    velocities."""
    written = lines_writing(seen, "velocity")
    reads = [k for k, a in enumerate(seen) if a.field == "velocity" and a.line not in written]
    early = {a.line for a in seen[: max(reads, default=0)] if is_write(a, "velocity")}
    return [a.line for a in writes if a.line in early] or [a.line for a in writes]


def impulse_lines(seen: Sequence[Access], cause: str) -> list[int]:
    """The lines that compute the impulse: those that read velocities or masses, depending on the
    cause. If there are none, the lines that write velocities."""
    moving, writes = lines_writing(seen, "position"), lines_writing(seen, "velocity")
    about: tuple[str, ...] = ("velocity", "mass")
    if re.search(r"velocit|scalar product|relative", cause):
        about = ("velocity",)
    elif re.search(r"mass|m[AB]|\be is|bracket|\(1 [+-] e\)|e = ", cause):
        about = ("mass",)
    for fields in (about, ("velocity", "mass")):
        for after in (after_displacement(seen), seen):
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
        self.code = code_of(text).splitlines()  # the lines without comments
        self.traced: dict[str, list[Access]] = {}
        self.questions = dict(QUESTIONS)

    def accesses(self, question: str) -> list[Access]:
        """The accesses that a question causes; none if the file lacks the function."""
        needed = self.questions[question].calls[0][0]
        if question not in self.traced:
            has = self.process.functions[needed]
            found = accesses_of(self.process, self.questions[question], self.text) if has else []
            self.traced[question] = found
        return self.traced[question]

    def part_of(self, question: str, failed_at: int) -> str:
        """The part of task 2 in which the call of a question failed, at the line `failed_at`."""
        return part_of(self.accesses(question), failed_at, self.text)

    def computes_with(self, field: str) -> bool:
        """Whether the collision function reads this field on lines that do not write it; True if
        its accesses are not known."""
        seen = self.accesses(SHOWN["2"])
        written = lines_writing(seen, field)
        return not seen or any(a.field == field and a.line not in written for a in seen)

    def writes(self, field: str) -> bool:
        """Whether the collision function writes this field, as far as its accesses are known."""
        return any_write(self.accesses(SHOWN["2"]), field)

    @property
    def integrates(self) -> bool:
        """Whether the collision function calls integrate: both write the angle on the same line."""
        turned = [
            {a.line for a in self.accesses(SHOWN[task]) if is_write(a, "alpha") and a.line}
            for task in ("1", "2")
        ]
        return not turned[0].isdisjoint(turned[1])

    def of(self, row: CheckRow) -> list[tuple[int, str]]:
        """The lines that a row is about, at most `MOST`, each with its number from 1."""
        if row.cause == INTEGRATES:
            seen = self.accesses(SHOWN["2"])
            numbers = [a.lines[1] for a in seen if is_write(a, "alpha") and len(a.lines) > 1]
        elif named := named_line(row.cause, self.text):
            # What performSimStep calls fails by what it is called with: that is at its loops.
            numbers = [named[0][0], *(self.loops() if row.task == "loop" else [])]
        elif row.name == "box":
            numbers = self.assignment_lines(re.findall(r"\bm(?:in|ax)[XY]\b", row.got))
        elif row.task == "loop":
            numbers = self.calls(row.name)
        elif "does not come back" in row.cause:
            numbers = self.endless_lines(self.accesses(SHOWN["1" if row.task == "1" else "2"]))
        elif "returns something new" in row.cause:
            numbers = self.returns(FUNCTIONS["1" if row.task == "1" else "2a"])
        elif row.name == SAME_AGAIN:
            numbers = self.assignment_lines(re.findall(r"global (\w+)", row.cause))
        else:
            numbers = self.access_lines(row)
            if row.task == "1" or row.cause == UNKNOWN or SHARES.search(row.cause):
                numbers = [*numbers, *self.feeding(numbers)]
        most = MOST_UNKNOWN if row.cause == UNKNOWN else MOST
        shown = sorted([k for k in dict.fromkeys(numbers) if k][:most])
        return [(k, cut(self.lines[k - 1].strip())) for k in shown if k <= len(self.lines)]

    def access_lines(self, row: CheckRow) -> list[int]:
        """The lines that read or write the numbers that a row of the two tasks judges."""
        seen = self.accesses(SHOWN["1" if row.task == "1" else "2"])
        if row.name in WRITTEN:
            who = {"velocity of A": {0}, "velocity of B": {1}}.get(row.name, {0, 1})
            if row.cause != UNKNOWN and not ONE_SPHERE.search(row.cause):
                who = {0, 1}
            writes = [a for a in seen if a.kind == "w" and a.field in WRITTEN[row.name]]
            # Where one sphere is not written at all, its lines belong beside those of the other.
            of_it = [a for a in writes if a.sphere in who] or writes
            if BEFORE in row.cause:
                return first_writes(seen, of_it)
            return [*calls_for_one(writes, of_it), *(a.line for a in of_it)]
        made = self.normal_lines(seen, row.cause)
        if row.task == "2a":
            sizes = detection_lines(seen)
            if row.cause == UNKNOWN:
                return [*distance_lines(seen), *sizes, *self.branches(sizes)]
            return [*made, *sizes, *(self.branches(sizes) if DECIDES.search(row.cause) else [])]
        if row.task == "2b":
            return made or displacement_lines(seen, row.cause)
        if row.task == "2c" and SIGN_OF_J in row.cause:
            # The displacement has the same normal, and is judged by itself: J comes first.
            return [*impulse_lines(seen, "mass"), *lines_writing(seen, "velocity")]
        if row.task == "2c" and ONE_PLACE in row.cause:
            return [*impulse_lines(seen, "velocities"), *lines_writing(seen, "velocity")]
        if row.task == "2c" and row.cause.startswith(AS_IF_EQUAL):
            return [*self.lines_of_j(seen), *lines_writing(seen, "velocity")]
        if row.task == "2c" and row.cause == APPROACH:
            velocities = [a.line for a in seen if a.field == "velocity"]
            return self.branches(velocities) or impulse_lines(seen, row.cause)
        if row.task == "2c" and NO_MASSES in row.cause:
            return self.lines_of_j(seen) or impulse_lines(seen, row.cause)
        if row.task == "2c":
            return made or self.with_results(impulse_lines(seen, row.cause), seen, row.cause)
        return lines_writing(seen, "velocity") if row.task == "2d" else []

    def branches(self, lines: Sequence[int]) -> list[int]:
        """The first line from the last of these on that compares two numbers in a condition."""
        last = max(lines, default=0)
        after = range(last, min(last + MOST, len(self.code)) + 1) if last else ()
        return [k for k in after if BRANCH.search(self.code[k - 1])][:1]

    def endless_lines(self, seen: Sequence[Access]) -> list[int]:
        """The head of the loop that a call does not leave, and the lines in it that are known."""
        if not seen:
            return []
        # The call was stopped anywhere: its latest access is not the same every time.
        body = sorted({a.line for a in seen[-LOOPS:-1]}) if repeated(seen) else []
        ahead = range(seen[-1].line, len(self.code) + 1)
        around = range(body[0] if body else 0, 0, -1)
        heads = (k for k in (around or ahead) if k and HEAD_OF_LOOP.search(self.code[k - 1]))
        return [next(heads, seen[-1].line), *body]

    def lines_of_j(self, seen: Sequence[Access]) -> list[int]:
        """The lines that set a variable after the last that reads a velocity, up to the first that
        writes one: those of J, if it reads no number of a sphere."""
        writes = lines_writing(seen, "velocity")
        reads = [a.line for a in seen if a.field == "velocity" and a.line not in writes]
        if not (reads and writes):
            return []
        return [k for k in range(max(reads) + 1, min(writes)) if assigned(self.code[k - 1])]

    def normal_lines(self, seen: Sequence[Access], cause: str) -> list[int]:
        """The lines that compute the normal or the distance, if the cause is about these.

        They are lines that read positions and write none; later lines that change the result before
        a velocity is written; and for the distance lines that use it before any write.
        """
        if ABOUT_OTHERS.search(cause) or not (ABOUT_NORMAL.search(cause) or "square" in cause):
            return []
        written = {a.line for a in seen if a.kind == "w"}
        before, after = (
            [
                line
                for line in dict.fromkeys(a.line for a in part if a.field == "position")
                if line and line not in written
            ]
            for part in (before_writes(seen), after_displacement(seen))
        )
        reads = (after if AFTER in cause else []) or before
        if not reads:
            return []
        made = {name for line in reads for name in assigned(self.code[line - 1])}
        kicks = [k for k in lines_writing(seen, "velocity") if k > max(reads)]
        between = [
            k
            for k in range(max(reads) + 1, min(kicks, default=max(reads) + 1))
            if k not in written and not self.code[k - 1].lstrip().startswith("if")
        ]
        changes = [k for k in between if made & {*assigned(self.code[k - 1])}]
        if ABOUT_NORMAL.search(cause):
            changes = changes or self.derived(reads, min(kicks, default=0), NOT_OF_NORMAL)
            return [*reads, *changes] if len(reads + changes) <= MOST else [*changes, *reads]
        used = rf"\b(?:{'|'.join(made)})\b"
        sums = [k for k in range(max(reads) + 1, max(reads) + 5) if k - 1 < len(self.code)]
        sums = [k for k in sums if k not in changes and not GUARD.search(self.code[k - 1])]
        return [k for k in sums if made and re.search(used, self.code[k - 1])][:2]

    def with_results(self, lines: list[int], seen: Sequence[Access], cause: str) -> list[int]:
        """Lines that read the numbers for the impulse; if they are several, or only the beginning
        of what the cause is about, also those that compute it from their variables, up to the first
        that writes a velocity."""
        if len({*lines}) < 2 and "relative speed" not in cause:
            return lines
        ends = [k for k in lines_writing(seen, "velocity") if k > max(lines, default=0)]
        return [*lines, *self.derived(lines, min(ends, default=0), NOT_OF_IMPULSE)]

    def derived(self, lines: Sequence[int], end: int, others: re.Pattern[str]) -> list[int]:
        """The lines before `end` that set a variable from those that these lines set; without
        lines that name `others`, and without those that use what such lines set."""
        made = {name for line in lines for name in assigned(self.code[line - 1])}
        found, apart = [], set[str]()
        for k in range(min(lines, default=end), end):
            names, used = {*assigned(self.code[k - 1])}, names_in(self.code[k - 1])
            if others.search(self.code[k - 1]) or used & apart:
                apart |= names
            elif k not in lines and names and made & used - names:
                made |= names
                found.append(k)
        return found

    def feeding(self, lines: Sequence[int]) -> list[int]:
        """The lines above these that last set a variable used in them, the nearest first; a line
        of a function only feeds those below it in the same function."""
        found: list[int] = []
        for line in lines:
            if not 0 < line <= len(self.code):
                continue
            heads = [k for k in range(1, line) if HEAD_OF_FUNCTION.search(self.code[k - 1])]
            begin = max(heads, default=0)
            for name in names_in(self.code[line - 1]):
                above = (
                    k for k in range(line - 1, begin, -1) if name in assigned(self.code[k - 1])
                )
                found += [k for k in [next(above, 0)] if k and k not in (*found, *lines)]
        return sorted(found, reverse=True)

    def returns(self, function: str) -> list[int]:
        """The lines on which a function returns something."""
        begin = next(iter(self.heads(function)), len(self.code))
        ends = (
            k
            for k in range(begin + 1, len(self.code) + 1)
            if HEAD_OF_FUNCTION.search(self.code[k - 1])
        )
        body = range(begin, next(ends, len(self.code) + 1))
        return [k for k in body if re.search(r"\breturn\s+[\w\[{(]", self.code[k - 1])]

    def calls(self, name: str) -> list[int]:
        """The lines of performSimStep that a row of the step is about; for a row about the edges
        the head of projectObjects."""
        if name not in CALLED:
            return self.heads("projectObjects" if name in ("edges", "ufo") else "performSimStep")
        function = CALLED[name]
        found = [
            k
            for k, line in enumerate(self.code, 1)
            if k > self.step_head
            and re.search(rf"\b{function}\s*\(", line)
            and k not in self.heads(function)
        ]
        if name in ("itself", "each pair once"):  # the loop over j stands last
            return [*self.loops_around(found[-1:]), *found[-1:]] or self.heads("performSimStep")
        if name in ("all spheres", "pairs"):  # the bounds of a loop may leave some out
            found = [*self.loops_around(found), *found]
        return found or self.heads("performSimStep")

    def loops(self) -> list[int]:
        """The lines of performSimStep that collide pairs, and the heads of their loops."""
        return [k for k in self.calls("pairs") if k > self.step_head]

    def loops_around(self, calls: Sequence[int]) -> list[int]:
        """The nearest head of a loop at or above each of these lines of performSimStep; 0 if there
        is none."""
        return [
            next(
                (
                    k
                    for k in range(call, self.step_head, -1)
                    if HEAD_OF_LOOP.search(self.code[k - 1])
                ),
                0,
            )
            for call in calls
        ]

    @property
    def step_head(self) -> int:
        """The line where performSimStep is defined; 0 if there is none."""
        return next(iter(self.heads("performSimStep")), 0)

    def heads(self, function: str) -> list[int]:
        """The lines where a function is defined."""
        head = re.compile(rf"\b(?:function|def|const|let|var)\s+{function}\b")
        return [k for k, line in enumerate(self.lines, 1) if head.search(line)]

    def assignment_lines(self, names: Sequence[str]) -> list[int]:
        """The lines that change one of these variables."""
        change = re.compile(rf"\b(?:{'|'.join(names)}){CHANGED}")
        return [k for k, line in enumerate(self.code, 1) if names and change.search(line)]
