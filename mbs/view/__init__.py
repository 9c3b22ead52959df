"""Pictures, movies, the report page and ParaView files of a run. Libraries that load slowly are imported inside functions."""
