"""Late binding: methods such as `Mechanism.plot` are implemented in higher packages and resolved by name at the first call.

Other installed packages extend Buckler through entry points:

- `buckler.kinds`: a class that files may name, an element, a body or a law.
- `buckler.exudyn`, by the name of the kind: `connect(scene, elements)`, as in `mbs/engine/loads.py`.
- `buckler.spectral`, likewise: `add(builder, name, element)`, as in `mbs/spectral/registry.py`.
- `buckler.symbols`, likewise: `symbol(sheet, name, element)`, as in `mbs/view/symbols.py`.

They are searched when a kind is not one of Buckler's own, and when a file is read.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from typing import Any

_OFFERS: dict[str, str] = {}


def offer(offers: Mapping[str, str]) -> None:
    """Register functions by name, as 'package.module:function'; they are loaded at the first call."""
    _OFFERS.update(offers)


def on_demand(package: str, modules: Mapping[str, str]) -> Callable[[str], Any]:
    """Make a package's `__getattr__` that imports a name from its module at the first use."""

    def load(name: str) -> Any:
        """Import a name, PEP 562."""
        if name not in modules:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        return getattr(import_module(f"{package}.{modules[name]}"), name)

    return load


def find_offer(name: str) -> Any:
    """Return the function of that name."""
    module, _, function = _OFFERS[name].partition(":")
    return getattr(import_module(module), function)


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
