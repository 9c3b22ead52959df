"""Mechanisms of files as studies: run, swept and shown from the command line and from Python."""
