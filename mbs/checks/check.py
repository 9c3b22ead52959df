"""Checks of a run: each has a name, a function that finds faults, and one that explains why the check does not apply."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from ..record.result import Result
from ..record.run import Run

FindFaults = Callable[[Run, Result], Iterator[str]]
"""Function that yields the faults of a run, each in words."""
FindReason = Callable[[Run, Result], str]
"""Function that returns the reason why a check does not apply to a run; '' if it applies."""


@dataclass(frozen=True)
class Check:
    """Check of a finished run."""

    name: str
    find: FindFaults
    why_not: FindReason = lambda _run, _result: ""

    def __call__(self, run: Run, result: Result) -> Iterator[str]:
        """Yield the faults of a run, each with the name of the check in front; none if the check does not apply."""
        if not self.why_not(run, result):
            yield from (f"{self.name}: {fault}" for fault in self.find(run, result))


def check(name: str, why_not: FindReason = Check.why_not) -> Callable[[FindFaults], Check]:
    """Make a decorator that turns a function that finds faults into a check."""
    return lambda find: Check(name, find, why_not)


def without(subjects: Callable[[Run], Iterable[object]], reason: str) -> FindReason:
    """Make the function `why_not` of a check of some subjects: it returns the reason if `subjects(run)` is empty, else ''."""
    return lambda run, _result: reason if next(iter(subjects(run)), None) is None else ""
