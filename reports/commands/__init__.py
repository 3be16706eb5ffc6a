"""The commands around a run: run, report, replay, diff, truth, list."""
