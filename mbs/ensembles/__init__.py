"""Ensembles: many runs of one mechanism that differ in what is unknown, and the statistics of their readings.

`channels` says which columns of the compiled solver a signal is, `statistics` accumulates them, `readings` is the grammar,
`members` draws numbers and starts, `ensemble` runs all of it.
"""
