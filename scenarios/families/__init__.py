"""The questions: every scene that anything here plays is made in this folder."""
