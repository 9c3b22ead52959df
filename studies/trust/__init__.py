"""Studies of accuracy, extreme cases, lean scenes and run time."""
