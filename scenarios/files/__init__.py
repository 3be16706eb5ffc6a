"""A scene as a TOML file, in and out."""
