"""Cells to results: workers, journal, resume, archive, tables, diff."""
