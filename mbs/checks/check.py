"""Checks of a run: a name, a function that finds faults, and one that says if the check does not apply."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from ..record.result import Result
from ..record.run import Run

Look = Callable[[Run, Result], Iterator[str]]
Idle = Callable[[Run, Result], str]


@dataclass(frozen=True)
class Check:
    """One check of a finished run; its sentences begin with its name.

    `look(run, result)` yields faults in words, without the name; `idle(run, result)` says why the check does not apply, or ''.
    """

    name: str
    look: Look
    idle: Idle = lambda _run, _result: ""

    def __call__(self, run: Run, result: Result) -> Iterator[str]:
        """Yield its sentences, name first."""
        if not self.idle(run, result):
            yield from (f"{self.name}: {fault}" for fault in self.look(run, result))


def check(name: str, idle: Idle = Check.idle) -> Callable[[Look], Check]:
    """Make a check from a function that finds faults: a decorator."""
    return lambda look: Check(name, look, idle)


def without(subjects: Callable[[Run], Iterable[object]], words: str) -> Idle:
    """Make the function that returns the words if a run has none of the subjects of a check, else ''."""
    return lambda run, _result: words if next(iter(subjects(run)), None) is None else ""
