"""Cross-validation of 2D disk solvers."""
