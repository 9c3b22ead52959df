"""Versions of Python, Buckler and the packages its numbers come from."""

from __future__ import annotations

import platform
from importlib import metadata


def versions() -> dict[str, str | None]:
    """Each by its name; None of what was never installed."""
    packages = ("buckler", "exudyn", "numpy", "scipy")
    return {"python": platform.python_version(), **{name: _version(name) for name in packages}}


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:  # a checkout that was never installed
        return None
