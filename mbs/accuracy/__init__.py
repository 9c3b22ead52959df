"""How far apart two runs are, how an accuracy asked for is delivered, error against run time."""
