"""Ensembles: many runs of one mechanism that differ in what is unknown, and the statistics of their readings.

`members` draws numbers and initial states, `readings` is the grammar of readings, `ensemble` runs all members.
"""
