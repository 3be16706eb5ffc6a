"""Where methods fail: for every player the value of a dimensionless parameter up to which it works."""
