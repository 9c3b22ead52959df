"""Mechanisms as files: TOML and JSON, numbers with units, formulas and tables, errors that name their place in the file."""
