"""Lesson 9, spin and friction: a file a page, and what the pages on a bounce share in
`thrown.py`."""
