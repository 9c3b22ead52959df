"""Derivatives of readings by numbers of a mechanism, fits of numbers to data, optimal designs."""
