"""Progress of the runs of one call: a bar, and a line with the expected time."""

from __future__ import annotations

import multiprocessing
import sys
import threading
from collections.abc import Callable
from contextvars import ContextVar
from typing import Any

from .process import working_time

SOON = 2.0
"""Seconds after which the expected time is printed: first steps are slower than others."""
WORTH = 3.0
"""Least expected time that is printed [s]."""
GROWTH = 8 ** (1 / 4)
"""Time of a run over that of the one before: tolerances of levels differ by 8, and steps are as their fourth root."""
after_step: ContextVar[Callable[[], object]] = ContextVar("after_step", default=lambda: None)
"""Function that is called before each step of a path or a response curve, whose number is not known beforehand."""
USUAL_RUNS = (2, 5)
"""Usual least and largest number of runs for one result: see `mbs.accuracy.refine`."""


class Forecast:
    """Progress callback of `simulate` that prints the expected time of all runs in a line, and draws a bar.

    Attributes
    ----------
    title : str
    cases : float
        Number of calls one after another, of which this is the first.
    bar : bool
        True to draw a bar.
    runs : (int, int)
        Least and largest number of runs of a call.
    """

    def __init__(self, title: str = "", cases: float = 1.0, bar: bool = True) -> None:
        self.title, self.cases, self.bar, self.runs = title, cases, bar, (1, 1)
        self.number, self.done, self.printed = 1, 0.0, False
        self.start = self.begin = working_time()
        self.drawn: Any = None

    def __call__(self, done: float) -> None:
        """Take the fraction of a run that is done; a smaller one than before, or one after 1, belongs to the next run."""
        if done < self.done or self.done >= 1.0:
            self.number, self.begin = self.number + 1, working_time()
        self.done = done
        if self.bar:
            self._draw()
        if not self.printed and done > 0 and working_time() - self.start >= SOON:
            self.printed = True
            if text := self.text():
                print(text, file=sys.stderr, flush=True)

    def text(self) -> str:
        """Write the expected time from now on; '' if it is short."""
        spent = working_time() - self.begin
        whole = spent / self.done
        least, most = (
            whole - spent + sum(whole * GROWTH**k for k in range(1, max(0, runs - self.number) + 1)) for runs in self.runs
        )
        if self.cases > 1:
            least, most = (each + (self.cases - 1) * (each + spent) for each in (least, most))
        if most < WORTH:
            return ""
        first, last = write_duration(least), write_duration(most)
        span = first if first == last else f"{first} to {last}"
        why = f"; this run takes {write_duration(whole)}, and finer ones tell its error" if self.runs[1] > self.number else ""
        cases = f", {self.cases:.3g} cases one after another" if self.cases > 1 else ""
        return f"{self.title}{': ' if self.title else ''}about {span} more{cases}{why}"

    def close(self) -> None:
        """Remove the bar."""
        if self.drawn is not None:
            self.drawn.close()

    def _draw(self) -> None:
        """Update the bar."""
        if self.drawn is None:
            from tqdm import tqdm  # loaded where a bar is wanted

            delay = 0.5 if sys.stderr.isatty() else 20.0  # a file gets lines
            form = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}"
            self.drawn = tqdm(total=1.0, delay=delay, mininterval=delay / 5, leave=False, bar_format=form)
        self.drawn.set_description_str(f"{self.title} run {self.number}".strip(), refresh=False)
        if self.done < self.drawn.n:
            self.drawn.update(-self.drawn.n)
        self.drawn.update(self.done - self.drawn.n)


def forecast(progress: bool | Callable[[float], None] | None) -> Callable[[float], None] | None:
    """Make the progress callback of `simulate`: the function given, or a `Forecast`, by default in terminals and notebooks."""
    if callable(progress):
        return progress
    return Forecast() if (is_interactive() if progress is None else progress) else None


def is_interactive() -> bool:
    """Return True in the main thread of a parent process whose standard error is a terminal, or that serves a notebook."""
    first = multiprocessing.parent_process() is None and threading.current_thread() is threading.main_thread()
    return first and (sys.stderr.isatty() or "ipykernel" in sys.modules)


def write_duration(seconds: float) -> str:
    """Write a time to one or two digits: 12 s, 3 min, 2 h."""
    for size, unit, limit in ((1.0, "s", 90.0), (60.0, "min", 5400.0)):
        if seconds < limit:
            return f"{max(1, round(seconds / size))} {unit}" if seconds >= 1 else "1 s"
    return f"{seconds / 3600:.2g} h"
