"""Self-checks of a finished run."""
