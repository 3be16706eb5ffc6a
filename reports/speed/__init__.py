"""Speed against accuracy: what an engine costs, what it gets for it, and what a scene needs."""
