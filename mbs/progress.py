"""Progress of the runs of one call: a bar, and a line with the expected time."""

from __future__ import annotations

import multiprocessing
import sys
import threading
from collections.abc import Callable
from contextvars import ContextVar
from functools import wraps
from math import inf
from time import perf_counter
from typing import Any, TypeVar, cast

from .process import COMPILING, CTRL_C, CtrlC, Interrupted, ctrl_c, working_time
from .validate import positive

SOON = 2.0
"""Seconds after which the expected time is printed: first steps are slower than others."""
TICK = 0.5
"""Time between two moves of a bar [s]."""
WORTH = 3.0
"""Least expected time that is printed [s]."""
GROWTH = 8 ** (1 / 4)
"""Time of a run over that of the one before: tolerances of levels differ by 8, and steps are as their fourth root."""
USUAL_RUNS = (2, 5)
"""Usual least and largest number of runs for one result: see `mbs.accuracy.refine`."""


class TimeUpError(Exception):
    """The time that a call may take is over."""


STOPS = (TimeUpError, KeyboardInterrupt)
"""Exceptions of a limit of time and of Ctrl-C."""


class Forecast:
    """Progress callback of `simulate` that writes the expected time of all runs, for `cases` such calls one after another.

    A call takes `runs`, at least and at most. Without a `bar` only the time is printed.
    """

    def __init__(self, title: str = "", cases: float = 1.0, bar: bool = True) -> None:
        self.title, self.cases, self.bar, self.runs = title, cases, bar, (1, 1)
        self.number, self.done, self.begin = 1, 0.0, working_time()

    def __call__(self, done: float) -> None:
        """Take the fraction of a run that is done; a smaller one than before, or one after 1, belongs to the next run."""
        if done < self.done or self.done >= 1.0:
            self.number, self.begin = self.number + 1, working_time()
        self.done = done

    def line(self) -> str:
        """Write the state of the run."""
        return f"{self.title} run {self.number}: {100 * self.done:.0f} %".strip() if self.bar and self.done else ""

    def text(self) -> str:
        """Write the expected time from now on; '' if it is short or unknown."""
        if not self.done:
            return ""
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


class Ticker:
    """Line of a terminal that a thread of its own renews, also within a long step, and one that tells how long it takes.

    The state's `line` writes the first and its `text` the second, after `SOON`; '' where there is nothing to say. Nothing is
    written while something is compiled, or only then, if this is the ticker of that.
    """

    def __init__(self, state: Forecast | Watch, compiles: bool = False, told: bool = False) -> None:
        self.state, self.compiles, self.told, self.over = state, compiles, told, threading.Event()
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def stop(self) -> bool:
        """Take the line away; return True if the time was told."""
        self.over.set()
        self.thread.join()
        return self.told

    def _run(self) -> None:
        """Write the lines until it is over."""
        start, clear = perf_counter(), "\r\x1b[K" if sys.stderr.isatty() else ""
        while not self.over.wait(TICK):
            if COMPILING.runs is not self.compiles:
                continue
            if not self.told and perf_counter() - start >= SOON and (text := self.state.text()):
                print(f"{clear}{text}", file=sys.stderr, flush=True)
                self.told = True
            if clear and (line := self.state.line()):
                print(f"{clear}{line}", end="", file=sys.stderr, flush=True)
        print(clear, end="", file=sys.stderr, flush=True)


class Watch:
    """Count of the steps or runs of one call: how long it takes, its limit of time, Ctrl-C.

    Their number is not known beforehand, but perhaps the `share` of the way that is done, or the `most` that are allowed. What
    counts them asks before each, where it can end with the best so far. `ended` says why it did.
    """

    def __init__(self, unit: str = "steps", timeout: float | None = None, clock: Callable[[], float] = working_time) -> None:
        self.unit, self.timeout, self.clock, self.pressed = unit, timeout, clock, CtrlC()
        self.count, self.share, self.most, self.ended, self.start = 0, 0.0, inf, "", clock()
        self.best: Any = None

    def step(self, share: float = 0.0) -> None:
        """Count a step. An exception ends the call, see `check`; after it no step begins."""
        self.check()
        if self.ended:
            raise TimeUpError(self.ended)
        self.count, self.share = self.count + 1, max(share, self.share)

    def check(self) -> None:
        """Raise KeyboardInterrupt or TimeUpError, once, where Ctrl-C came or the time is over."""
        if self.pressed() and not self.ended:
            self.pressed.pressed, self.ended = False, CTRL_C
            raise KeyboardInterrupt(CTRL_C)
        if not self.ended and self.timeout and self.clock() > self.start + self.timeout:
            self.ended = f"timeout = {self.timeout:g} s is over"
            raise TimeUpError(self.ended)

    def end_run(self, failure: tuple[str, str] | None) -> None:
        """Raise what ended a run, if it is Ctrl-C or the time."""
        self.check()
        if failure and failure[0] == "INTERRUPTED":
            raise KeyboardInterrupt(CTRL_C)

    @property
    def time_left(self) -> float | None:
        """Time that is left [s]; None without a limit, and where what there is is put together after it."""
        whole = None if self.ended else self.timeout
        return whole and max(1e-3, self.start + whole - self.clock())

    def line(self) -> str:
        """Write the state of the call."""
        way = f", {100 * self.share:.0f} % of the way" if self.share else ""
        return f"{self.count} {self.unit}{way}, {write_duration(self.clock() - self.start)}"

    def text(self) -> str:
        """Say how long it will take from now on: at the rate so far and, at most, for all steps that are allowed."""
        spent = self.clock() - self.start
        likely = f"about {write_duration(spent / self.share - spent)} more at this rate" if self.share > 0.0 else ""
        if self.most == inf:
            return likely or f"{self.count} {self.unit} so far; how many it takes is not known beforehand, timeout = limits it"
        bound = f"at most {write_duration(spent * self.most / self.count - spent)}" if self.count else ""
        return ", ".join(filter(None, (likely, bound and f"{bound} for {self.most:.0f} {self.unit}")))


UNWATCHED = Watch()
"""Watch of calls without one; it ends nothing."""
watching: ContextVar[Watch] = ContextVar("watching", default=UNWATCHED)
"""Watch of the call that runs."""
F = TypeVar("F", bound=Callable[..., Any])


def watch(unit: str) -> Callable[[F], F]:
    """Give a function that counts its `unit` its parameters `timeout` and `progress`.

    If it is stopped it returns its best so far, on which `mark_stopped` is called, if there is one. After Ctrl-C that comes with
    `Interrupted`. Within another such function the outer one is stopped, too.
    """

    def decorate(call: F) -> F:
        @wraps(call)
        def wrapper(*given: Any, timeout: float | None = None, progress: bool | None = None, **named: Any) -> Any:
            outer = watching.get()
            limit = None if timeout is None else positive("timeout", timeout, "s")
            state = Watch(unit, limit) if outer is UNWATCHED else outer
            show = outer is UNWATCHED and (is_interactive() if progress is None else progress)
            ticker, token = Ticker(state) if show else None, watching.set(state)
            try:
                with ctrl_c() as state.pressed:
                    ended, found = state.ended, call(*given, **named)
            except Exception as error:
                if state.pressed():  # within a compilation it comes back as whatever the compiler makes of it
                    raise KeyboardInterrupt(CTRL_C) from error
                raise
            finally:
                watching.reset(token)
                if ticker:
                    ticker.stop()
            if state is outer and state.ended != ended:
                raise TimeUpError(state.ended)
            if state.ended and state is not outer:
                found = found.mark_stopped(state.ended) if hasattr(found, "mark_stopped") else found
            if state.ended == CTRL_C and state is not outer:
                raise Interrupted(found)
            return found

        return cast(F, wrapper)

    return decorate


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
