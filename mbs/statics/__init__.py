"""Equilibria, their paths, natural frequencies, periodic motions: on the compiled solver's equations."""
