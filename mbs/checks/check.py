"""Checks of a run: each has a name, a function that finds faults, and subjects without which it does not apply."""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass

from ..record.result import Result
from ..record.run import Run

FindFaults = Callable[[Run, Result], Iterator[str]]
"""Function that yields the faults of a run, each in words."""
FindSubjects = Callable[[Run], Collection[object] | bool]
"""Function that returns the parts of a run that a check examines, such as its stops, or True if it has any."""


@dataclass(frozen=True)
class Check:
    """Check of a finished run; the `reason` says in words why it does not apply to a run without `subjects`."""

    name: str
    find: FindFaults
    subjects: FindSubjects
    reason: str

    def __call__(self, run: Run, result: Result) -> Iterator[str]:
        """Yield the faults of a run, each with the name of the check in front; none if the check does not apply."""
        if self.subjects(run):
            yield from (f"{self.name}: {fault}" for fault in self.find(run, result))


def check(name: str, subjects: FindSubjects = lambda _run: True, reason: str = "") -> Callable[[FindFaults], Check]:
    """Make a decorator that turns a function that finds faults into a check, by default of every run."""
    return lambda find: Check(name, find, subjects, reason)
