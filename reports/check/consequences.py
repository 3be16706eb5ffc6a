"""Which faults follow from one in an earlier task: a mistake is one fault, wherever it shows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from reports.check.rows import FOLLOWS, TASKS, UNKNOWN, CheckRow

# One mistake in the distance or the normal, by the words that its tasks have for it.
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
# what is said of velocities where no formula gives them
NOT_EXPLAINED = (UNKNOWN, "unknown: ", "the restitution depends", "the file has e = ")


def with_consequences(rows: Sequence[CheckRow]) -> list[CheckRow]:
    """The rows, with the verdict "follows" for a fault that is another task's as well."""
    first: dict[str, str] = {}  # cause -> the task that has it first
    for row in sorted(rows, key=lambda row: list(TASKS).index(row.task)):
        if row.verdict == "fault" and row.cause not in (FOLLOWS, UNKNOWN):
            for cause in {row.cause}.union(*(same for same in SAME_MISTAKE if row.cause in same)):
                first.setdefault(cause, row.task)
    pushed = displaced_velocities(rows)
    return [followed(row, first, pushed) if row.verdict == "fault" else row for row in rows]


def followed(row: CheckRow, first: dict[str, str], pushed: bool) -> CheckRow:
    """A fault, or what it follows from.

    first: of each cause the task that has it first; pushed: as `displaced_velocities` says.
    """
    if row.cause == FOLLOWS:
        return replace(row, verdict="follows")
    if (task := first.get(row.cause, row.task)) != row.task:
        return replace(row, verdict="follows", cause=f"it follows from the fault in {task}")
    if pushed and row.task in ("2c", "2d") and row.cause.startswith(NOT_EXPLAINED):
        cause = "it may follow from the fault in 2b, which changes the velocities, too"
        return replace(row, verdict="follows", cause=cause)
    return row


def displaced_velocities(rows: Iterable[CheckRow]) -> bool:
    """Whether the displacement of (b) was found to change velocities."""
    return any((row.task, row.name, row.verdict) == ("2b", "velocities", "fault") for row in rows)
