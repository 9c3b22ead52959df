"""Output for people: pictures, movies, the report page, ParaView, tables. Heavy imports stand in functions."""
