"""Stop a call at one of its looks for Ctrl-C and the limit of time."""

from itertools import count
from math import inf

from buckler.mbs.progress import Watch

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
