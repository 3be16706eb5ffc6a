"""What every command says and how it ends: console, progress, exit status, text of others."""
