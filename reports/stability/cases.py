"""All cases by name, in reading order."""

from __future__ import annotations

from reports.stability.cases_alone import ALONE
from reports.stability.cases_collisions import COLLISIONS
from reports.stability.cases_friction import FRICTION
from reports.stability.cases_gas import GAS
from reports.stability.cases_stacks import STACKS
from reports.stability.cases_suite import SUITE
from reports.stability.limits import Case

CASES: dict[str, Case] = {
    case.name: case for case in (*COLLISIONS, *ALONE, *FRICTION, *STACKS, *GAS, *SUITE)
}
