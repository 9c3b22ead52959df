"""What other installed packages add, by entry points: kinds of elements and laws, and how a solver or picture gets a kind.

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
    """What packages offer in a group, by name; one that does not load is warned of and left out."""
    from importlib import metadata  # a tenth of the time that importing this package takes, and seldom needed

    found: dict[str, Any] = {}
    for point in metadata.entry_points(group=group):
        try:
            found[point.name] = point.load()
        except Exception as error:
            whose = f" of {point.dist.name}" if point.dist else ""
            told = f"{group}: '{point.name}'{whose} does not load: {type(error).__name__}: {error}"
            warnings.warn(told, RuntimeWarning, stacklevel=2)
    return found
