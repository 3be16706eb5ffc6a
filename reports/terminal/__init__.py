"""The output and the end of every command: console, progress, exit status, foreign text."""
