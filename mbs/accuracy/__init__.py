"""Differences of two runs, and refinement of a run until an accuracy is met."""
