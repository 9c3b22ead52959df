"""Studies of the strip at rest."""
