"""Short pages in the order a learner needs, each with a scene that runs, sliders, and the exact
answer beside it."""
