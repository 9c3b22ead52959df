"""What rooms above do for values below, such as `Mechanism.plot`: the values ask by name, the package's door says who does it."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

_OFFERS: dict[str, str] = {}


def offer(offers: Mapping[str, str]) -> None:
    """Say which functions do what is asked for by name, as 'package.module:function'; they are loaded when asked for."""
    _OFFERS.update(offers)


def offered(name: str) -> Any:
    """Return the function of that name."""
    module, _, function = _OFFERS[name].partition(":")
    return getattr(import_module(module), function)
