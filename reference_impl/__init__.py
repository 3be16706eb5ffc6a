"""The disk solver by hand: `exercise`, `lesson`, `ordered`; `crowd` and `neighbours` make the first fast for many."""
