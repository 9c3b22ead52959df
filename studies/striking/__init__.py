"""Studies of the compliant slider-crank, and its design."""
