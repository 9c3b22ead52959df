"""Late binding: methods such as `Mechanism.plot` are implemented in packages above and resolved by name at the first call."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
