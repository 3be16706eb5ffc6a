"""The oracle: collision by collision, in many digits, certified."""
