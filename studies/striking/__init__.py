"""Studies of the compliant slider-crank that strikes a stop, and its inverse design."""
