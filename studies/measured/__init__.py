"""Mechanisms that others have measured: what is fitted to a part of the data, and how the rest is predicted."""
