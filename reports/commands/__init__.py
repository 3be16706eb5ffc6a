"""The commands around a run: run, report, diff, truth, list."""
