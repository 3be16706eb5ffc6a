"""Lesson 6, how engines differ: a file a page, and what the pages share in `ablation.py`."""
