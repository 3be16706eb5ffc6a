"""Judges somebody's own solver of the exercise, and says what is wrong with it."""
