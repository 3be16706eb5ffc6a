"""The command `crosscheck`, or `python -m reports`: it can be stopped by a signal before it has imported what it
needs."""

import sys

from reports.terminal.safe_path import leave_out_current_folder


def main() -> None:
    """Do what the command line asks for."""
    leave_out_current_folder()  # before anything else is imported
    from reports.terminal.exits import ends_on_signals, refuse
    from reports.terminal.streams import printing

    with ends_on_signals(), printing():
        if sys.flags.optimize > 1:
            refuse(
                ["PYTHONOPTIMIZE=2, or python -OO, takes away the docstrings that metrics are explained by; unset it"]
            )
        from reports.cli import app  # which takes a second: what is raised while it is imported may be lost

        app()


if __name__ == "__main__":
    main()
