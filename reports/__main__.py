"""The command `crosscheck`, or `python -m crosscheck2d.reports`: it can be stopped by a signal
before it has imported what it needs."""

import sys


def main() -> None:
    """Do what the command line asks for."""
    from crosscheck2d.adapters.safe_path import keep_path_safe

    keep_path_safe()  # before anything else is imported
    from crosscheck2d.reports.terminal.exits import ends_on_signals, printing, refuse

    with ends_on_signals(), printing():
        if sys.flags.optimize > 1:
            refuse(
                "PYTHONOPTIMIZE=2, or python -OO, takes away the docstrings that metrics are"
                " explained by; unset it"
            )
        # which takes a second: what is raised while it is imported may be lost
        from crosscheck2d.reports.cli import app

        app()


if __name__ == "__main__":
    main()
