"""A user's own engine in a file with create, step and read, as opposed to a solver of the
exercise."""
