"""JUnit XML: a test suite for each file, a test case for each question."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

from reports.check.evidence import evidence
from reports.check.marks import Marked
from reports.check.outcomes import OUTCOMES
from reports.run.made import sealed

# what an earlier file of ours begins with, and nothing else does
JUNIT = b'<testsuites name="crosscheck check"'


def as_junit(marked: Sequence[Marked]) -> str:
    """A test suite for each file, a test case for each row; a fault is a failure, what was not
    asked or follows from a fault is skipped. The class of the cases is the student's id."""
    suites = ElementTree.Element("testsuites", name="crosscheck check")
    for student in marked:
        one = student.check
        skipped = sum(OUTCOMES[row.verdict].junit == "skipped" for row in one.rows)
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
                suite, "testcase", classname=plain(student.id), name="file: is a solver"
            )
            ElementTree.SubElement(case, OUTCOMES["refused"].junit, message=plain(one.refused))
        for row in one.rows:
            case = ElementTree.SubElement(
                suite,
                "testcase",
                classname=plain(student.id),
                name=plain(f"{row.task}: {row.name}"),
            )
            if OUTCOMES[row.verdict].junit == "failure":
                failure = ElementTree.SubElement(case, "failure", message=plain(row.cause))
                failure.text = plain("\n".join([row.asked, *evidence(row)]))
            elif OUTCOMES[row.verdict].junit == "skipped":
                ElementTree.SubElement(case, "skipped", message=plain(row.cause))
        ElementTree.SubElement(suite, "system-out").text = plain(student.total)
    ElementTree.indent(suites)
    return sealed(ElementTree.tostring(suites, encoding="unicode", xml_declaration=True) + "\n")


def plain(text: str) -> str:
    """Text without the characters that XML 1.0 has no way to write."""
    return "".join(
        c if c in "\t\n\r" or " " <= c <= "\ud7ff" or "\ue000" <= c <= "\ufffd" else "\ufffd"
        for c in text
    )
