"""Wheels and archives of the source, from a checkout with links and from one where they became text files."""

import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("elastica", "mbs", "studies")
BUILD = "import sys, setuptools.build_meta as back; print(getattr(back, sys.argv[1])(sys.argv[2]))"


def built(tree, kind, to):
    """Build a wheel or an archive of the source of a tree, without the network."""
    to.mkdir()
    run = subprocess.run([sys.executable, "-W", "ignore", "-c", BUILD, kind, str(to)], cwd=tree, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr[-2000:]
    return to / run.stdout.split()[-1]


@pytest.fixture(scope="module", params=["links", "text files"])
def tree(request, tmp_path_factory):
    """A copy of what an install needs."""
    copy = tmp_path_factory.mktemp("tree")
    leave = shutil.ignore_patterns("__pycache__")
    for name in PACKAGES:
        shutil.copytree(ROOT / name, copy / name, ignore=leave)
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, copy / name)
    (copy / "src/buckler").mkdir(parents=True)
    for name in PACKAGES:
        link = copy / "src/buckler" / name
        if request.param == "links":
            link.symlink_to(f"../../{name}")
        else:
            link.write_text(f"../../{name}")
    return copy


@pytest.mark.parametrize("by", ["tree", "archive of the source"])
def test_a_wheel_holds_all_modules_and_data(tree, by, tmp_path):
    if by != "tree":
        with tarfile.open(built(tree, "build_sdist", tmp_path / "archive")) as archive:
            archive.extractall(tmp_path, filter="data")
    start = tree if by == "tree" else next(path for path in tmp_path.iterdir() if path.name.startswith("buckler-"))
    names = set(zipfile.ZipFile(built(start, "build_wheel", tmp_path / "wheel")).namelist())
    modules = {f"buckler/{path.relative_to(tree).as_posix()}" for name in PACKAGES for path in (tree / name).rglob("*.py")}
    data = {"buckler/mbs/py.typed", "buckler/studies/own/examples/six-bar.toml", "buckler/mbs/view/page/report.html"}
    assert modules | data <= names
