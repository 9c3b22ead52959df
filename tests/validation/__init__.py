"""Answers that are known otherwise, each with one verdict. `python tests/validation` runs them and writes their table."""
