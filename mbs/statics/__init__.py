"""Equilibria, their paths, natural frequencies and periodic motions, from the equations of the compiled solver."""
