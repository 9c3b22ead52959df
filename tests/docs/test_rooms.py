"""The picture of the rooms in docs/architecture.md is true: imports go down in it."""

import re

from imported import ROOT, imports, sources

PICTURE = re.search(r"```text\n(.*?)```", (ROOT / "docs/architecture.md").read_text(encoding="utf-8"), re.DOTALL)[1]
FLOORS = [re.split(r"[ ,]+", re.split(r"(?<=\S) {4,}", line)[0].strip()) for line in PICTURE.splitlines()]
TOOLS = {"process", "progress", "units"}
"""Files that are used everywhere and use next to nothing."""


def floors():
    """Height of each room."""
    return {room: len(FLOORS) - k for k, floor in enumerate(FLOORS) for room in floor}


def needs():
    """Pairs of rooms of which the first imports the second, wherever in a file, what types alone need left out."""
    found = {}
    for path in sources("mbs"):
        parts = path.relative_to(ROOT / "mbs").parts
        here = parts[0].removesuffix(".py") if parts != ("__init__.py",) else "door"
        for name in imports(path, with_types=False):
            if name.startswith("buckler.mbs."):
                found[here, name.split(".")[2]] = path.relative_to(ROOT).as_posix()
    return {pair: where for pair, where in found.items() if pair[0] != pair[1]}


def test_every_room_is_in_the_picture():
    rooms = {path.name for path in (ROOT / "mbs").iterdir() if path.is_dir() and any(path.glob("*.py"))}
    files = {path.stem for path in (ROOT / "mbs").glob("*.py")} - {"__init__"}
    assert set(floors()) | TOOLS == rooms | files | {"door"}


def test_rooms_import_rooms_below_them_only():
    height = {**floors(), **dict.fromkeys(TOOLS, 0)}
    found = needs()
    assert len(found) > 50  # or the above reads nothing
    up = {pair: where for pair, where in found.items() if pair[0] not in TOOLS and height[pair[0]] <= height.get(pair[1], 0)}
    assert not up
