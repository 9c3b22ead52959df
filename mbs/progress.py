"""Progress and end of a call that takes long: a line that a terminal renews, the expected time, `timeout`, Ctrl-C.

`Forecast` is the state of `simulate`, whose runs report a fraction done. `Watch` is that of calls which count steps or runs. A
`Ticker` prints either from a thread of its own. The decorator `watch` gives a function a `Watch`.
"""

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

from .process import COMPILING, CTRL_C, Handler, Interrupted, catch_ctrl_c, working_time
from .validate import positive

GROWTH = 8 ** (1 / 4)
"""Time of a run over that of the coarser run before it, which has 8 times the tolerance tol: steps go as tol^(1/4)."""


class TimeUpError(Exception):
    """The time limit of a call is over, or an inner call has been stopped."""


USER_STOPS = (TimeUpError, KeyboardInterrupt)
"""Exceptions by which a time limit and Ctrl-C end a call."""


class Forecast:
    """Progress callback of one call of `simulate`: it forecasts the time of all its runs, and of the `cases` - 1 calls after it.

    `cases` is the number of calls that a process makes, as of a sweep: a mean, if several processes share them. `runs` is the
    least and the largest number of runs of a call. Without a `bar` only the time is printed.
    """

    def __init__(self, title: str = "", cases: float = 1.0, bar: bool = True) -> None:
        self.title, self.cases, self.bar, self.runs = title, cases, bar, (1, 1)
        self.number, self.done, self.begin, self.done_at_begin = 1, 0.0, inf, 0.0

    def __call__(self, done: float) -> None:
        """Note the fraction of a run that is done; a fraction that falls, or follows a 1, is of the next run."""
        if self.begin == inf:  # the time before the first step loads and prepares what further runs have
            self.begin, self.done_at_begin = working_time(), done
        elif done < self.done or self.done >= 1.0:
            self.number, self.begin, self.done_at_begin = self.number + 1, working_time(), 0.0
        self.done = done

    def line(self) -> str:
        """Write the number and the fraction done of the run."""
        return f"{self.title} run {self.number}: {100 * self.done:.0f} %".strip() if self.bar and self.done else ""

    def text(self) -> str:
        """Write the expected time from now on; '' if it is short or unknown."""
        if self.done <= self.done_at_begin:
            return ""
        run_time = (working_time() - self.begin) / (self.done - self.done_at_begin)  # without the time spent compiling
        earlier = sum(run_time * GROWTH**k for k in range(1 - self.number, 0))  # time of the coarser runs before this one
        expected = []
        for runs in self.runs:
            later = sum(run_time * GROWTH**k for k in range(1, runs - self.number + 1))
            of_other_cases = max(0.0, self.cases - 1) * (earlier + run_time + later)
            expected.append(run_time * (1.0 - self.done) + later + of_other_cases)
        if max(expected) < 3.0:  # [s]: not worth a line
            return ""
        first, last = map(write_duration, expected)
        span = first if first == last else f"{first} to {last}"
        why = f"; this run takes {write_duration(run_time)}, and finer ones tell its error" if self.runs[1] > self.number else ""
        cases = f", {self.cases:.3g} cases one after another" if self.cases > 1 else ""
        return f"{self.title}{': ' if self.title else ''}about {span} more{cases}{why}"


class Ticker:
    """Thread that renews a line in a terminal, also within a long step, and prints the expected time once.

    It does so after 2 s, as the first steps of a run are slower than others. `state.line()` and `state.text()` write the line and
    the expected time; an empty text is not printed. While a call compiles a function, a second ticker, with `compiles`, prints
    instead of that of the call. `announced` is True if an earlier ticker has printed the time.
    """

    def __init__(self, state: Forecast | Watch, compiles: bool = False, announced: bool = False) -> None:
        self.state, self.compiles, self.announced, self.over = state, compiles, announced, threading.Event()
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def stop(self) -> bool:
        """End the thread and clear the line; return True if the expected time was printed."""
        self.over.set()
        self.thread.join()
        return self.announced

    def _run(self) -> None:
        start, clear = perf_counter(), "\r\x1b[K" if sys.stderr.isatty() else ""
        while not self.over.wait(0.5):  # [s] between two renewals of the line
            if COMPILING.is_active is not self.compiles:
                continue
            if not self.announced and perf_counter() - start >= 2.0 and (text := self.state.text()):
                print(f"{clear}{text}", file=sys.stderr, flush=True)
                self.announced = True
            if clear and (line := self.state.line()):
                print(f"{clear}{line}", end="", file=sys.stderr, flush=True)
        print(clear, end="", file=sys.stderr, flush=True)


class Watch:
    """Count of the steps or runs of one call, with its time limit [s] and Ctrl-C.

    `share` is the fraction of the call that is done, 0 if unknown, `most` the largest number of steps. `ended` is the reason for
    which the call was stopped, '' while it may go on. `best` is the best answer so far. `clock` is a clock without compile time.
    """

    def __init__(self, unit: str = "steps", timeout: float | None = None, clock: Callable[[], float] = working_time) -> None:
        self.unit, self.timeout, self.clock, self.ctrl_c = unit, timeout, clock, Handler()
        self.count, self.share, self.most, self.ended, self.start = 0, 0.0, inf, "", clock()
        self.best: Any = None

    def step(self, share: float = 0.0) -> None:
        """Count a step before it begins; raise as `check` does. A stopped call makes no step: TimeUpError."""
        self.check()
        if self.ended:
            raise TimeUpError(self.ended)
        self.count, self.share = self.count + 1, max(share, self.share)

    def check(self) -> None:
        """Raise KeyboardInterrupt after Ctrl-C or TimeUpError after the time limit, once: the call then makes its best answer."""
        if self.ctrl_c() and not self.ended:
            self.ctrl_c.is_pressed, self.ended = False, CTRL_C  # from now on only another Ctrl-C counts
            raise KeyboardInterrupt(CTRL_C)
        if not self.ended and self.timeout and self.clock() > self.start + self.timeout:
            self.ended = f"timeout = {self.timeout:g} s is over"
            raise TimeUpError(self.ended)

    def end_run(self, failure: tuple[str, str] | None) -> None:
        """Raise as `check` does after a run, and KeyboardInterrupt if its `failure`, (status, message), is that by Ctrl-C."""
        self.check()
        if failure and failure[0] == "INTERRUPTED":  # by a second Ctrl-C, as `check` raises after the first
            raise KeyboardInterrupt(CTRL_C)

    @property
    def time_left(self) -> float | None:
        """Time that is left [s], at least 1e-3; None without a limit and for a stopped call, which completes its answer."""
        if self.timeout is None or self.ended:
            return None
        return max(1e-3, self.start + self.timeout - self.clock())

    def line(self) -> str:
        """Write the number of steps, the fraction done and the time spent."""
        done = f", {100 * self.share:.0f} % of the way" if self.share else ""
        return f"{self.count} {self.unit}{done}, {write_duration(self.clock() - self.start)}"

    def text(self) -> str:
        """Write the expected time from now on, at the rate so far, and its bound for all steps that are allowed."""
        spent = self.clock() - self.start
        likely = f"about {write_duration(spent / self.share - spent)} more at this rate" if self.share > 0.0 else ""
        if self.most == inf:
            return likely or f"{self.count} {self.unit} so far; how many it takes is not known beforehand; a timeout limits it"
        if not self.count:
            return likely
        longest = spent * self.most / self.count - spent
        bound = f"at most {write_duration(longest)} for {self.most:.0f} {self.unit}"
        return f"{likely}, {bound}" if likely and spent / self.share - spent < longest else bound


UNWATCHED = Watch()
"""Watch outside of all calls; it never stops one."""
watching: ContextVar[Watch] = ContextVar("watching", default=UNWATCHED)
"""Watch of the current call."""
F = TypeVar("F", bound=Callable[..., Any])


def watch(unit: str) -> Callable[[F], F]:
    """Make a decorator that adds `timeout` and `progress` to a function which counts its `unit`, steps or runs, by a `Watch`.

    The function has to catch `USER_STOPS` and return its best answer so far, whose `mark_stopped` is called if it exists. After
    Ctrl-C the answer is raised in `Interrupted`. A watched function that another one calls counts in the watch of the outer one:
    its own `timeout` and `progress` have no effect, and once stopped it raises TimeUpError.
    """

    def decorate(call: F) -> F:
        """Add the two parameters."""

        @wraps(call)
        def wrapper(*arguments: Any, timeout: float | None = None, progress: bool | None = None, **named: Any) -> Any:
            """Call the function under a watch."""
            limit = None if timeout is None else positive("timeout", timeout, "s")
            outer = watching.get()
            if outer is not UNWATCHED:
                ended_before = outer.ended
                answer = _call_under(outer, call, arguments, named)
                if outer.ended != ended_before:  # stopped in this call, also by Ctrl-C: the outer call makes its best answer
                    raise TimeUpError(outer.ended)
                return answer
            state = Watch(unit, limit)
            ticker = Ticker(state) if (is_interactive() if progress is None else progress) else None
            try:
                answer = _call_under(state, call, arguments, named)
            finally:
                if ticker:
                    ticker.stop()
            if state.ended and hasattr(answer, "mark_stopped"):
                answer = answer.mark_stopped(state.ended)
            if state.ended == CTRL_C:
                raise Interrupted(answer)
            return answer

        return cast(F, wrapper)

    return decorate


def _call_under(state: Watch, call: Callable[..., Any], arguments: tuple[Any, ...], named: dict[str, Any]) -> Any:
    """Call a function under a watch, to which Ctrl-C is reported."""
    token = watching.set(state)
    try:
        with catch_ctrl_c() as state.ctrl_c:  # in a nested call this is the handler of the outer one
            answer = call(*arguments, **named)
        if state.ctrl_c() and not state.ended:
            state.ended = CTRL_C  # not seen by `check`: in the compiler the handler itself raises, and `call` catches that
        return answer
    except Exception as error:
        if state.ctrl_c():  # the compiler turns a KeyboardInterrupt into an exception of its own
            raise KeyboardInterrupt(CTRL_C) from error
        raise
    finally:
        watching.reset(token)


def forecast(progress: bool | Callable[[float], None] | None, runs: tuple[int, int]) -> Callable[[float], None] | None:
    """Return the progress callback of `simulate`: a given function, or a `Forecast` of `runs`; None if nothing is shown."""
    if not callable(progress):
        progress = Forecast() if (is_interactive() if progress is None else progress) else None
    if isinstance(progress, Forecast):
        progress.runs = runs
    return progress


def is_interactive() -> bool:
    """Return True if a terminal or notebook shows output, in the main thread of a process that no other Python started."""
    is_main = multiprocessing.parent_process() is None and threading.current_thread() is threading.main_thread()
    return is_main and (sys.stderr.isatty() or "ipykernel" in sys.modules)


def write_duration(seconds: float) -> str:
    """Write a time to one or two digits: 12 s, 3 min, 2 h; at least 1 s."""
    if seconds < 90.0:
        return f"{max(1, round(seconds))} s"
    return f"{round(seconds / 60)} min" if seconds < 5400.0 else f"{seconds / 3600:.2g} h"
