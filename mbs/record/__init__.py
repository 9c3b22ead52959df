"""Results of runs: signals, energies, shapes, the result."""
