"""Lesson 6, how engines differ: a file for each page, and what the pages share in `ablation.py`."""
