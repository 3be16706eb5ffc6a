"""The oracle: event by event, in many digits, certified."""
