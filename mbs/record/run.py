"""One pass of a solver: what it left, how it ended, what it cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from ..elements.signal import Signal, Trait
from ..geometry import Array
from .energy import ledger
from .errors import Status
from .record import Record
from .signals import collect


@dataclass(frozen=True, eq=False)
class Run:
    """One pass of a solver: its record, failure, work, and the numbers of what the scene was made of.

    `notes` hold what is worth knowing of the mechanism, as redundant constraints left out; `unseen` the edges of a user's
    function that the run passed. `asked` is a text that names the signals wanted; '' for all.
    """

    solver: Any
    record: Record
    failure: tuple[Status, str] | None
    work: dict[str, float]
    summary: Mapping[str, int] = field(default_factory=dict)
    notes: Sequence[str] = ()
    unseen: str = ""
    asked: str = ""

    @cached_property
    def signals(self) -> dict[str, Signal]:
        """All signals by name."""
        return collect(self.record, self.asked)

    @cached_property
    def ledger(self) -> dict[str, Array]:
        """Energies over the run [J], as `record.energy.ledger` makes them."""
        return ledger(self.record)

    @property
    def values(self) -> dict[str, Array]:
        """Values of the signals, each (times,)."""
        return {name: signal.values for name, signal in self.signals.items()}

    @property
    def units(self) -> dict[str, str]:
        """Units of the signals."""
        return {name: signal.unit for name, signal in self.signals.items()}

    @property
    def traits(self) -> dict[str, Trait]:
        """Properties of the signals."""
        return {name: signal.trait for name, signal in self.signals.items()}
