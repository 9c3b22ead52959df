"""Items of evidence: each a study with settings, whose numbers are kept in a file that the documents quote."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
FILES = ROOT / "docs" / "evidence"
"""One file an item: settings, seed, commit, versions, run time, numbers and tables."""


@dataclass(frozen=True)
class Item:
    """A study with settings.

    Attributes
    ----------
    study : name in the registry
    given : settings that are not the study's defaults
    quick : takes a few seconds, so that every check runs it
    needs_data : reads measurements that are not part of the project: `--data DIR`
    figures : pictures of docs/figures that it draws: name of the study's figure, name of the picture
    """

    study: str
    given: Mapping[str, Any] = field(default_factory=dict)
    quick: bool = False
    needs_data: bool = False
    figures: Mapping[str, str] = field(default_factory=dict)


ITEMS: dict[str, Item] = {
    "slider-crank": Item("slider-crank", quick=True),
    "slider-crank-voltage": Item(
        "slider-crank-voltage", {"bows": (0.003, 0.01, 0.02, -0.01)}, figures={"figure": "slider-crank-voltage"}
    ),
    "paper-figures": Item("paper-figures", figures={"figure": "paper-figures"}),
    "experiments": Item("experiments", needs_data=True, figures={"figure": "experiments"}),
    "buffering-claims": Item(
        "buffering-claims", {"members": 3, "cycles": 3, "worlds": 0, "clearance": (1e-4,), "in_plane_depth": (0.02,)}
    ),
    "gravity-flip": Item("gravity-flip", figures={"figure": "gravity-flip"}),
    "elastica-law": Item("elastica-law"),
    "contact-force-table": Item("contact-force-table"),
    "dynamic-buckling": Item("dynamic-buckling", quick=True),
    "restitution": Item("restitution"),
    "static-precision": Item("static-precision"),
    "solver-speed": Item("solver-speed"),
}


def stored(name: str) -> dict[str, Any]:
    """What the file of an item holds; nothing where it was never run."""
    path = FILES / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
