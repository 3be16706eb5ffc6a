"""The engines whose measurements the repository keeps: those of reports/bits.csv.

A new engine is in none of the kept tables until all of them are made again, which takes hours on a
machine of its own. The tests of these tables ask them for the engines that are measured.
"""

from crosscheck2d.reports.run import bits

TABLE = bits.read(bits.KEPT.read_text("utf-8"))
MEASURED = frozenset(TABLE.engine + ":" + TABLE.profile)
