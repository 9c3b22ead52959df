"""A mapping that stays as it was made."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any


class Frozen(Mapping[str, Any]):
    """An immutable mapping of names; it can be compared, hashed and pickled."""

    __slots__ = ("_items",)

    def __init__(self, items: Mapping[str, object] | Iterable[tuple[str, object]] = ()) -> None:
        self._items = dict(items)

    def __getitem__(self, name: str) -> Any:
        return self._items[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __hash__(self) -> int:
        return hash(frozenset(self._items.items()))

    def __repr__(self) -> str:
        return repr(self._items)

    def __setitem__(self, name: str, _value: object) -> None:
        raise TypeError(f"cannot set '{name}': a mechanism does not change; make another with dataclasses.replace")
