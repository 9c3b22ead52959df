"""How far apart two runs are, and how an accuracy asked for is delivered."""
