"""Checks of a run: each has a name, a function that finds faults, and subjects without which it does not apply."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from ..record.result import Result
from ..record.run import Run

FindFaults = Callable[[Run, Result], Iterator[str]]
"""Function that yields the faults of a run, each in words."""
FindSubjects = Callable[[Run], Iterable[object]]
"""Function that returns the parts of a run that a check examines, such as its stops."""


@dataclass(frozen=True)
class Check:
    """Check of a finished run; the `reason` says in words why it does not apply to a run without `subjects`."""

    name: str
    find: FindFaults
    subjects: FindSubjects
    reason: str

    def applies(self, run: Run) -> bool:
        """Return True if a run has subjects of the check."""
        return any(True for _ in self.subjects(run))

    def __call__(self, run: Run, result: Result) -> Iterator[str]:
        """Yield the faults of a run, each with the name of the check in front; none if the check does not apply."""
        if self.applies(run):
            yield from (f"{self.name}: {fault}" for fault in self.find(run, result))


def check(name: str, subjects: FindSubjects = lambda run: [run], reason: str = "") -> Callable[[FindFaults], Check]:
    """Make a decorator that turns a function that finds faults into a check, by default of every run."""
    return lambda find: Check(name, find, subjects, reason)
