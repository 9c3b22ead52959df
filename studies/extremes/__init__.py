"""Extreme and random mechanisms, each run held against a reference of its own."""
