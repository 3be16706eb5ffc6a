"""The questions and their exact answers."""
