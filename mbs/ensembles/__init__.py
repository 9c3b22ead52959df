"""Ensembles: many runs of one mechanism that differ in what is unknown, and the statistics of their readings.

`statistics` accumulates signals stretch by stretch of a run, `readings` is the grammar, `members` draws numbers and starts,
`ensemble` runs all of it.
"""
