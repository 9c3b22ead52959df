"""Extensions by other installed packages, through entry points: kinds of elements and laws, for solvers and pictures.

| group | name | value |
|---|---|---|
| `buckler.kinds` | any | a class that files may name: an element, a body or a law |
| `buckler.exudyn` | name of the kind | `connect(scene, elements)`, as in `mbs/engine/loads.py` |
| `buckler.spectral` | name of the kind | `add(builder, name, element)`, as in `mbs/spectral/registry.py` |
| `buckler.symbols` | name of the kind | `symbol(sheet, name, element)`, as in `mbs/view/symbols.py` |

They are looked for where a kind is not found among Buckler's own, and when a file is read.
"""

from __future__ import annotations

import warnings
from functools import cache
from typing import Any


@cache
def extensions(group: str) -> dict[str, Any]:
    """Return the objects that packages add to a group, by name; warn of one that does not load and leave it out."""
    from importlib import metadata  # a tenth of the time that importing this package takes, and seldom needed

    found: dict[str, Any] = {}
    for point in metadata.entry_points(group=group):
        try:
            found[point.name] = point.load()
        except Exception as error:
            whose = f" of {point.dist.name}" if point.dist else ""
            text = f"{group}: '{point.name}'{whose} does not load: {type(error).__name__}: {error}"
            warnings.warn(text, RuntimeWarning, stacklevel=2)
    return found
