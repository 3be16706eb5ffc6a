"""A solver of somebody's own, Exercise.js or solver.py, as an engine in a process of its own."""
