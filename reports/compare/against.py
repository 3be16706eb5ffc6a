"""What a number is measured against: the values of `Metric.against`.

The first two also stand in the column `versus` of deviations.csv; a number measured against another
engine has that engine's `engine:profile` there.
"""

ITSELF = "itself"  # the laws of physics and the run's own start
TRUTH = "truth"  # the exact answer
ENGINE = "engine"  # another engine at the same dt
