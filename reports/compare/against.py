"""What a number is measured against: the values of `Metric.against`.

The column `versus` of deviations.csv holds the first two; for another engine it holds that engine's
`engine:profile`.
"""

ITSELF = "itself"  # the laws of physics and the start of the run
TRUTH = "truth"  # the exact answer
ENGINE = "engine"  # another engine at the same dt
