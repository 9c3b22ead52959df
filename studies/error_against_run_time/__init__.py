"""Error against run time: works, hand-tuned runs of the engine, contents of each scene."""
