"""Pictures, movies, the report page, ParaView files, tables. Slow imports are made in functions."""
