"""A hand-written engine that is not the exercise, in a file of its own: create, step, read."""
