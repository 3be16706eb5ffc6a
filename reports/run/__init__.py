"""Cells to results: store, pool, tables, diff."""
