"""The compiled second solver: spectral strips in absolute coordinates, a constant mass matrix, joints as constraints."""
