"""Studies of Buckler's mechanisms, each in one file. `python -m studies list` names them."""
