"""What each engine does otherwise than exact flight with end-of-step detection, and the solver that
can ablate it."""
