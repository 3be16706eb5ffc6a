"""The probes: what an engine promises, asked of it in scenes with one answer each."""
