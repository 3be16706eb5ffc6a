"""The oracle: an event-driven computation in many digits, certified by intervals."""
