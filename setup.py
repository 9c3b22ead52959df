"""Find the folders of the three packages; all else stands in pyproject.toml."""

from pathlib import Path

from setuptools import setup

PACKAGES = ("elastica", "mbs", "studies")

# Links below `src` let an editable install be a path, which editors and mypy follow. A checkout on Windows has text files in
# their place, an archive nothing: then the folders are named one by one.
PLACE = Path("src/buckler")
if all((PLACE / name).is_dir() for name in PACKAGES):
    setup(package_dir={"": "src"})
else:
    PLACE.mkdir(parents=True, exist_ok=True)
    setup(package_dir={"buckler": str(PLACE), **{f"buckler.{name}": name for name in PACKAGES}})
