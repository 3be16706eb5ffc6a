"""A user's own solver, Exercise.js or solver.py, as an engine in a separate process."""
