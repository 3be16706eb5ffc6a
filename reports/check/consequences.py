"""Which faults follow from one in an earlier task: a mistake counts as one fault, however many
tasks show it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from crosscheck2d.reports.check.detection import NOT_OF_THE_CENTRES
from crosscheck2d.reports.check.functions import keeps_state
from crosscheck2d.reports.check.impacts import ABSOLUTE_NORMAL
from crosscheck2d.reports.check.impulse import ONLY, UNALIKE
from crosscheck2d.reports.check.projection import WITHOUT_IMPULSE
from crosscheck2d.reports.check.rows import FOLLOWS, TASKS, UNKNOWN, CheckRow

# The causes that different tasks report for one mistake in the distance or the normal.
SAME_MISTAKE = (
    {
        "the squared distance is compared with a size that is not squared",
        "the squared distance is used as the distance",
        "it is divided by n.n, though n is a unit vector, or a square root is missing",
    },
    {
        "the distance is not a number (a field that does not exist, a division by zero?)",
        "the positions become NaN or infinite",
    },
    {
        "they are moved with the wrong sign of x or of y",
        "one part of the normal has the wrong sign",
    },
    {
        "they are moved with x and y of the normal exchanged",
        "x and y of the normal are exchanged",
    },
    {"the sizes are used as diameters", "brackets are missing: sizes / 2 - distance"},
    {"the sizes are doubled", "brackets are missing: each is moved by sizes - distance / 2"},
    {
        "only the size of A is used",
        "only the size of B is used",
        "the size of A is used twice",
        "the size of B is used twice",
        UNALIKE,
    },
    {"they are moved by the absolute values of the normal", ABSOLUTE_NORMAL},
    {"they are moved along x only", "the normal is taken along x"},
    {"they are moved along y only", "the normal is taken along y"},
    {
        "they are moved by the x part of the normal in x and in y",
        "the normal has its x part twice",
        "dx is used for dy, too",
    },
    {
        "they are moved by the y part of the normal in x and in y",
        "the normal has its y part twice",
        "dy is used for dx, too",
    },
)
# causes of wrong velocities that no known formula gives
NOT_EXPLAINED = (UNKNOWN, "unknown: ", ONLY, "the restitution depends", "the file has e = ")


def with_consequences(rows: Sequence[CheckRow]) -> list[CheckRow]:
    """The rows, with the verdict "follows" for a fault that an earlier task already has."""
    first: dict[str, str] = {}  # cause -> the task that has it first
    for row in sorted(rows, key=lambda row: list(TASKS).index(row.task)):
        if row.verdict == "fault" and row.cause not in (FOLLOWS, UNKNOWN):
            for cause in {row.cause}.union(*(same for same in SAME_MISTAKE if row.cause in same)):
                first.setdefault(cause, row.task)
        if (row.name, row.verdict) == ("impulse", "fault"):
            first[IMPULSE] = row.task
        if row.verdict == "fault" and row.cause.startswith(ONLY):
            first[ONE_VELOCITY] = row.task
    spoilt = spoilers(rows)
    return [followed(row, first, spoilt) if row.verdict == "fault" else row for row in rows]


def followed(row: CheckRow, first: dict[str, str], spoilt: dict[str, str]) -> CheckRow:
    """A fault, or a row that follows from another.

    first: cause -> the first task that has it; spoilt: the result of `spoilers`.
    """
    if row.cause == FOLLOWS:
        return replace(row, verdict="follows")
    if (task := first.get(row.cause, row.task)) != row.task:
        return replace(row, verdict="follows", cause=f"it follows from the fault in {task}")
    if row.cause == WITHOUT_IMPULSE and ONE_VELOCITY in first:
        why = "it follows from the fault in the velocity of one sphere"
        return replace(row, verdict="follows", cause=why)
    unexplained = row.cause.startswith(NOT_EXPLAINED)
    if row.task in spoilt and (unexplained or (row.cause, spoilt[row.task]) in EXPLAINED_TOO):
        return replace(row, verdict="follows", cause=spoilt[row.task])
    from_impulse = (row.name, row.cause) == ("separating", UNKNOWN) or (
        row.name == "restitution" and row.cause.startswith("the file has e = ")
    )
    if from_impulse and IMPULSE in first:
        return replace(row, verdict="follows", cause="it follows from the fault in the impulse")
    return row


KEPT = "it may follow from the value that is kept from one call to the next"
NORMAL = "it may follow from the fault in 2a: the normal is along another line than the centres"
# Causes that have a name, though they follow, too: in a fresh world the mean of J and the J before
# it, which is 0, and the sum of the two; a normal that is not reversed when A and B are exchanged.
EXPLAINED_TOO = {
    ("the impulse is halved", KEPT),
    ("the impulse is counted twice", KEPT),
    (UNALIKE, NORMAL),
}
# keys of `first` that are no causes
IMPULSE = "the impulse is wrong"
ONE_VELOCITY = "the velocity of one sphere is wrong"


def spoilers(rows: Iterable[CheckRow]) -> dict[str, str]:
    """Task -> why a fault that nothing explains may follow from an explained one."""
    rows = list(rows)
    spoilt: dict[str, str] = {}
    if any((row.task, row.name, row.verdict) == ("2b", "velocities", "fault") for row in rows):
        spoilt |= dict.fromkeys(
            ("2c", "2d"), "it may follow from the fault in 2b, which changes the velocities, too"
        )
    for row in rows:
        if row.verdict == "fault" and row.cause.startswith(NOT_OF_THE_CENTRES):
            spoilt |= dict.fromkeys(("2b", "2c", "2d"), NORMAL)
        if keeps_state([row]):
            parts = ("1",) if row.task == "1" else ("2a", "2b", "2c", "2d")
            spoilt |= dict.fromkeys(parts, KEPT)
    return spoilt
