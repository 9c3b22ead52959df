"""Exudyn: how each element becomes items of the engine, how a run is made and recorded."""
