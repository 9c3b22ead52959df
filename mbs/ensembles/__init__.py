"""Ensembles: many runs of one mechanism that differ in what is unknown, and the statistics of their readings."""
