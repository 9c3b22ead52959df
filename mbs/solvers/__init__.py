"""Solvers as values: their settings, and which of them suits a mechanism. Nothing here computes."""
