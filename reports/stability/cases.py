"""All cases by name, in reading order."""

from __future__ import annotations

from reports.stability.cases_alone import ALONE
from reports.stability.cases_gas import GAS
from reports.stability.cases_hits import HITS
from reports.stability.cases_stacks import STACKS
from reports.stability.cases_suite import SUITE
from reports.stability.limits import Case

CASES: dict[str, Case] = {case.name: case for case in (*HITS, *ALONE, *STACKS, *GAS, *SUITE)}
