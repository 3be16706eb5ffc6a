"""The disk solver by hand: `exercise`, `lesson`, `ordered`; `verlet_list` and `neighbours` make the
first fast for many."""
