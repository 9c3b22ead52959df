"""Sweeps: many cases of one study, stored as they end."""
