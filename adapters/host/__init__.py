"""Code of others, in processes of its own."""
