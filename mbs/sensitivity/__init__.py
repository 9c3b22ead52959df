"""Derivatives of results by the numbers of a mechanism, fits to data, optimal designs."""
