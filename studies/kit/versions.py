"""Versions of Python, Buckler and the packages its numbers come from."""

from __future__ import annotations

import platform
from importlib import metadata


def versions() -> dict[str, str | None]:
    """Look up each version by its package; None for a package that was never installed."""
    packages = ("buckler", "exudyn", "numpy", "scipy")
    return {"python": platform.python_version(), **{name: _version(name) for name in packages}}


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:  # a checkout that was never installed
        return None


def print_versions() -> int:
    """Print all versions in one line."""
    print(", ".join(f"{name} {version or 'of a checkout'}" for name, version in versions().items()))
    return 0
