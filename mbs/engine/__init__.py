"""Exudyn: how each element becomes items of the engine, how a run is made and recorded."""

import os

os.environ.setdefault("EXUDYN_NO_USER_SETTINGS", "1")
