"""A package of somebody's own, installed beside Buckler: magnets."""
