"""Studies of Buckler's mechanisms, each in one module. `python -m studies list` names them."""
