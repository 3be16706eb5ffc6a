"""The oracle: an event-driven computation in many digits, certified where intervals are
installed."""
