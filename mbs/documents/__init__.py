"""Documents, plain dictionaries and lists: as the text of TOML and JSON files, and changed by path."""
