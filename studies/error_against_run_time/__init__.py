"""Error against run time: works, the hand-tuned engine beside them, what each scene is made of."""
