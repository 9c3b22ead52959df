"""Documents: dictionaries, lists, texts and numbers, as read from TOML and JSON files and written to them."""
