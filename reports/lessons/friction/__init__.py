"""Lesson 9, spin and friction: a file for each page, and what the pages on a bounce share in
`thrown.py`."""
