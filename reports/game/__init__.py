"""The exercise's game through several engines at once, in a browser."""
