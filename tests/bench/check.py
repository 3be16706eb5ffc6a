"""Prints what a check costs: `python -m tests.bench.check` checks the first hundred of the
catalogue as a class.

Seconds by the clock depend on what else the machine does; those of the processors do so far less.
"""

from __future__ import annotations

import os
import tempfile
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from pathlib import Path
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage
from time import monotonic

from crosscheck2d.reports.check.verdict import check_file
from tests.reports.check.confusion import judged
from tests.solvers.mutants import CORRECT, MUTANTS


def spent() -> float:
    return sum(
        use.ru_utime + use.ru_stime for use in map(getrusage, (RUSAGE_SELF, RUSAGE_CHILDREN))
    )


def main() -> None:
    for path in (one for one in CORRECT if one.stem in ("plain", "arrays")):
        began, before = monotonic(), spent()
        check_file(path)
        print(f"{path.name}: {monotonic() - began:.1f} s, {spent() - before:.1f} s of processors")
    with tempfile.TemporaryDirectory() as folder:
        paths = [mutant.write(Path(folder)) for mutant in MUTANTS[:100]]
        began, before = monotonic(), spent()
        judged(paths)
        print(
            f"100 files: {monotonic() - began:.0f} s, {spent() - before:.0f} s of {os.cpu_count()}"
            " processors"
        )


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    parser.parse_args()
    main()
