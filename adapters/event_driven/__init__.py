"""The event-driven engine: no steps, from collision to collision, in float64."""
