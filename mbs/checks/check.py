"""Checks of a run: name, condition of failure, thresholds, and the function that looks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from ..record.result import Result
from ..record.run import Run

Look = Callable[[Run, Result], Iterator[str]]
Idle = Callable[[Run, Result], str]


@dataclass(frozen=True)
class Check:
    """One check of a finished run.

    Attributes
    ----------
    name : str
        The word its sentences begin with.
    fails : str
        When it fails, in words: 'failed when ...'.
    look : callable
        `look(run, result)` yields what is wrong, in words without the name; nothing in a run that may be trusted.
    thresholds : mapping of str to float
        The numbers that decide, by what they are.
    idle : callable
        `idle(run, result)` says in words why there is nothing to look at; '' where there is.
    """

    name: str
    fails: str
    look: Look
    thresholds: Mapping[str, float] = field(default_factory=dict)
    idle: Idle = lambda _run, _result: ""

    def __call__(self, run: Run, result: Result) -> Iterator[str]:
        """Yield its sentences, name first."""
        if self.idle(run, result):
            return
        for said in self.look(run, result):
            yield f"{self.name}: {said}"


def check(
    name: str, fails: str, thresholds: Mapping[str, float] | None = None, idle: Idle = Check.idle
) -> Callable[[Look], Check]:
    """Make a check of the function that looks: a decorator."""
    return lambda look: Check(name, fails, look, thresholds or {}, idle)


def without(subjects: Callable[[Run], Iterable[object]], words: str) -> Idle:
    """Make what says in words that a run has none of what a check looks at."""
    return lambda run, _result: words if next(iter(subjects(run)), None) is None else ""
