"""What `crosscheck check` writes for programs, a file a format; formats.py is the table of them."""
