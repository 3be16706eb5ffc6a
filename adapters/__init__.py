"""The players: one file an engine, and the one loop that plays a scenario."""
