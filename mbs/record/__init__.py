"""What a run leaves behind: signals, energies, shapes, the result."""
