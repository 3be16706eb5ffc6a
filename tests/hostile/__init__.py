"""Inputs that no program should be given, and what becomes of them: `test_hostile.py` plays all of
them."""
