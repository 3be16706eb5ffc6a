"""Keeps the current folder off the path that modules are imported from.

What lies where a command is started is no part of it: a student's random.py would be run in the place of Python's own.
"""

import os  # as little as possible, and what Python has imported before the folder was on its path
import sys

PROGRAM = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def leave_out_current_folder() -> None:
    """Take it off `sys.path`, unless it is the folder that this program itself is imported from.

    Python has put it there for `python -m`, and for an empty entry of PYTHONPATH, as in `$PYTHONPATH:/else` where
    nothing was set before.
    """
    try:
        here = os.path.realpath(os.getcwd())
    except OSError:
        return  # nothing lies in a folder that is gone
    if here != os.path.realpath(PROGRAM):
        sys.path[:] = [folder for folder in sys.path if folder and os.path.realpath(folder) != here]
