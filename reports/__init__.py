"""Everything a person looks at: the comparison, its tables and charts, the page, the command
line."""
