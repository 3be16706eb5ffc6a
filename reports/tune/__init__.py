"""The search for the settings by which an engine is nearest to the scenes it is given: `crosscheck
tune`."""
