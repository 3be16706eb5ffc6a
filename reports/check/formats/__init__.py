"""What `crosscheck check` writes for programs, a file for each format; formats.py is the table of
them."""
