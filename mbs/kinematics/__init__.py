"""Assembly, velocities and accelerations of the ideal linkage."""
