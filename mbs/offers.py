"""What rooms above do for values below, such as `Mechanism.plot`: the values ask by name, the package's door says who does it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

_OFFERS: dict[str, str] = {}


def offer(offers: Mapping[str, str]) -> None:
    """Say which functions do what is asked for by name, as 'package.module:function'; they are loaded when asked for."""
    _OFFERS.update(offers)


def on_demand(package: str, rooms: Mapping[str, str]) -> Callable[[str], Any]:
    """A package's `__getattr__`: names by the modules below it that have them, imported when they are asked for."""

    def found(name: str) -> Any:
        if name not in rooms:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        return getattr(import_module(f"{package}.{rooms[name]}"), name)

    return found


def offered(name: str) -> Any:
    """Return the function of that name."""
    module, _, function = _OFFERS[name].partition(":")
    return getattr(import_module(module), function)
