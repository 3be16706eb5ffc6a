"""All cases by name, and the headings they stand under, in reading order."""

from __future__ import annotations

from crosscheck2d.reports.stability.cases_few import ALONE, COLLISIONS
from crosscheck2d.reports.stability.cases_friction import FRICTION
from crosscheck2d.reports.stability.cases_gas import GAS
from crosscheck2d.reports.stability.cases_stacks import STACKS
from crosscheck2d.reports.stability.limits import Case
from crosscheck2d.reports.stability.vary import SUITE

FAMILIES = {
    "One collision": COLLISIONS,
    "One disk, or two": ALONE,
    "Friction": FRICTION,
    "Stacks, piles and overlaps": STACKS,
    "A gas at e = 1": GAS,
    "The largest dt of the suite's scenes": SUITE,
}
"""Heading -> its cases."""
CASES: dict[str, Case] = {case.name: case for cases in FAMILIES.values() for case in cases}
FAMILY_OF = {case.name: family for family, cases in FAMILIES.items() for case in cases}
