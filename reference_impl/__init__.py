"""The disk solver by hand: `exercise`, `lesson`, `ordered`, and `neighbours`, which is `exercise`
without the pairs that cannot touch."""
