"""Progress of the runs of one call: a bar with the time that each still takes."""

from __future__ import annotations

import multiprocessing
import sys
import threading
from collections.abc import Callable
from contextvars import ContextVar

after_step: ContextVar[Callable[[], object]] = ContextVar("after_step", default=lambda: None)
"""Function that is called before each step of a path or a response curve, whose number is not known beforehand."""


class Bar:
    """Progress callback of `simulate`: a bar of the present run, its number and the time that is left of it."""

    def __init__(self, title: str = "") -> None:
        from tqdm import tqdm  # loaded where a bar is wanted

        delay = 0.5 if sys.stderr.isatty() else 20.0  # a file gets lines
        form = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}, {remaining} left"
        self.title, self.number = title, 0
        self.drawn = tqdm(total=1.0, delay=delay, mininterval=delay / 5, leave=False, bar_format=form)
        self._begin()

    def __call__(self, done: float) -> None:
        """Take the share of a run that is done; one that falls, or follows 1, is of the next run."""
        if done < self.drawn.n or self.drawn.n >= 1.0:
            self.drawn.reset()
            self._begin()
        self.drawn.update(done - self.drawn.n)

    def close(self) -> None:
        """Take the bar away."""
        self.drawn.close()

    def _begin(self) -> None:
        self.number += 1
        self.drawn.set_description_str(f"{self.title} run {self.number}".strip(), refresh=False)


def follow(progress: bool | Callable[[float], None] | None) -> Callable[[float], None] | None:
    """Make what `simulate` calls after each step: the function given, or a bar, by default where someone looks on."""
    if callable(progress):
        return progress
    return Bar() if (looked_at() if progress is None else progress) else None


def looked_at() -> bool:
    """Return True in the main thread of a first process whose standard error is a terminal, or that serves a notebook."""
    first = multiprocessing.parent_process() is None and threading.current_thread() is threading.main_thread()
    return first and (sys.stderr.isatty() or "ipykernel" in sys.modules)
