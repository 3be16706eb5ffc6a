"""Where methods fail: for every engine the value of a dimensionless parameter up to which it
works."""
