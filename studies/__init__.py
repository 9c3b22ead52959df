"""Studies: what Buckler's mechanisms are asked, each in one file. `python -m studies list` names them."""
