"""The checks for programs: JSON as check.schema.json says, and JUnit XML."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from reports.check.rows import CheckRow
from reports.check.verdict import FileCheck

SCHEMA = Path(__file__).parent / "check.schema.json"


def as_json(checks: Sequence[FileCheck]) -> dict[str, Any]:
    """All files with all rows; the same shape for one file and for many."""
    return {
        "crosscheck": version("crosscheck2d"),
        "passed": all(one.passed for one in checks),
        "files": [
            {
                "file": str(one.path),
                "passed": one.passed,
                "refused": one.refused,
                "tasks": one.tasks,
                "sentences": one.sentences,
                "rows": [row_as_json(row) for row in one.rows],
            }
            for one in checks
        ],
    }


def row_as_json(row: CheckRow) -> dict[str, Any]:
    """A row, its fields in reading order."""
    return {
        "name": row.name,
        "task": row.task,
        "asked": row.asked,
        "got": row.got,
        "expected": row.expected,
        "verdict": row.verdict,
        "cause": row.cause,
        "formula": row.formula,
        "lines": [{"line": line, "text": text} for line, text in row.lines],
        "read": row.read,
    }


def as_junit(checks: Sequence[FileCheck]) -> str:
    """A test suite a file, a test case a row; a fault is a failure, what was not asked or follows
    from a fault is skipped."""
    suites = ElementTree.Element("testsuites", name="crosscheck check")
    for one in checks:
        skipped = sum(row.verdict in ("not asked", "follows") for row in one.rows)
        suite = ElementTree.SubElement(
            suites,
            "testsuite",
            name=plain(str(one.path)),
            tests=str(len(one.rows) or 1),
            failures=str(len(one.faults)),
            errors=str(int(bool(one.refused))),
            skipped=str(skipped),
        )
        if one.refused:
            case = ElementTree.SubElement(
                suite, "testcase", classname=plain(one.path.name), name="file: is a solver"
            )
            ElementTree.SubElement(case, "error", message=plain(one.refused))
        for row in one.rows:
            case = ElementTree.SubElement(
                suite,
                "testcase",
                classname=plain(one.path.name),
                name=plain(f"{row.task}: {row.name}"),
            )
            if row.verdict == "fault":
                failure = ElementTree.SubElement(case, "failure", message=plain(row.cause))
                failure.text = plain("\n".join([row.asked, *evidence(row)]))
            elif row.verdict in ("not asked", "follows"):
                ElementTree.SubElement(case, "skipped", message=plain(row.cause))
    ElementTree.indent(suites)
    return ElementTree.tostring(suites, encoding="unicode", xml_declaration=True) + "\n"


def evidence(row: CheckRow) -> list[str]:
    """What speaks for a fault, a line each: the numbers, the file's lines, the formula."""
    lines = [f"came: {row.got}", f"expected: {row.expected}"]
    lines += [f"line {line}: {text}" for line, text in row.lines]
    lines += [f"exercise: {row.formula}"] * bool(row.formula)
    return [*lines, f"read: {row.read}"]


def plain(text: str) -> str:
    """Text without the characters that XML 1.0 has no way to write."""
    return "".join(
        c if c in "\t\n\r" or " " <= c <= "\ud7ff" or "\ue000" <= c <= "\ufffd" else "\ufffd"
        for c in text
    )
