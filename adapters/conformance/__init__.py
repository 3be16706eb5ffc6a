"""The probes: small scenes, each of which tests one property that an engine must have."""
