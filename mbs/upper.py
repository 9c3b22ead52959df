"""Doors to rooms above: what a mechanism or a result hands itself to for a drawing, a file or a page, loaded when asked for."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def upper(room: str, name: str) -> Any:
    """Return what is called `name` in a room of `buckler.mbs`, as "files.plot"."""
    return getattr(import_module(f"buckler.mbs.{room}"), name)
