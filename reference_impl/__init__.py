"""The exercise's disk solver, by hand: `exercise` (symplectic Euler) and `lesson` (explicit Euler), on plain arrays."""
