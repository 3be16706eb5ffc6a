"""The event-driven engine in float64: it has no steps and goes from event to event."""
