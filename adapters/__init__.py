"""The engines, and the one loop that plays a scenario."""
