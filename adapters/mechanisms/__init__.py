"""The mechanisms by which each engine differs from exact flight with end-of-step detection, and the
solver that can ablate them."""
