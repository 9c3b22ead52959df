"""Mechanism as solvers, statics and checks read it: elements, linkage, start, redundant constraints."""
