"""Runs of extreme and random mechanisms, each compared with a reference."""
