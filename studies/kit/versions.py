"""Versions of Python, Buckler and the packages that compute; the process that ran a case of a sweep."""

import hashlib
import platform
import socket
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from pathlib import Path


def versions() -> dict[str, str | None]:
    """Look up the version of each package; None for a package that is not installed."""
    found: dict[str, str | None] = {"python": platform.python_version()}
    for package in ("buckler", "exudyn", "numpy", "scipy"):
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = None
    return found


def print_versions() -> int:
    """Print all versions in one line; a package that is not installed runs from a checkout of its repository."""
    print(", ".join(f"{name} {version or 'of a checkout'}" for name, version in versions().items()))
    return 0


def describe_process() -> dict[str, object]:
    """Describe the process in which a case of a sweep ends now: versions, host, hash of the source files, time."""
    return {**_origin(), "ended": datetime.now(UTC).isoformat(timespec="seconds")}


@cache
def _origin() -> dict[str, object]:
    """Collect what is constant in a process: versions, host, and the SHA-256 hash of Buckler's source files."""
    root, digest = Path(__file__).resolve().parents[2], hashlib.sha256()
    for path in sorted(path for package in ("elastica", "mbs", "studies") for path in (root / package).rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return {"versions": versions(), "host": socket.gethostname(), "sources": digest.hexdigest()[:16]}
