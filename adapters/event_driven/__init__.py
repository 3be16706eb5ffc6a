"""The event-driven engine: no steps, event by event, in float64."""
