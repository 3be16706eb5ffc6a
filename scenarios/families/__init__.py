"""The scenarios: every scene of the project is made in this folder."""
