"""Stop a call at one of its looks for Ctrl-C and the limit of time, however fast the machine."""

import signal
from itertools import count
from math import inf

from buckler.mbs.progress import Watch
from buckler.mbs.spectral import run

LOOK = Watch.check


def stop_at(monkeypatch, look, by="timeout"):
    """Make the look of this number find the time over, or Ctrl-C; return the counter of looks."""
    number = count(1)

    def check(watch):
        if next(number) == look:
            watch.ctrl_c.is_pressed = by == "Ctrl-C"
            watch.timeout, watch.start = (1.0, -inf) if by == "timeout" else (None, watch.start)
        LOOK(watch)

    monkeypatch.setattr(Watch, "check", check)
    return number


def press_ctrl_c(call):
    """Return a function that presses Ctrl-C when it is called for the `call`-th time, such as the progress of a run."""
    number = count(1)
    return lambda *_: signal.raise_signal(signal.SIGINT) if next(number) == call else None


def press_ctrl_c_at(monkeypatch, look):
    """Press Ctrl-C at the look of this number at the clock of the compiled solver."""
    press = press_ctrl_c(look)
    monkeypatch.setattr(run, "working_time", lambda: press() or 0.0)
