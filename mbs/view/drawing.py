"""What a picture of a mechanism is made of: a few marks, each tied to a frame that moves. Every picture draws the same marks.

A frame has a place and an angle turned since t = 0. Lengths are in m, in the axes of the ground at t = 0.
"""

from __future__ import annotations

from typing import Any, NamedTuple

Points = tuple[tuple[float, float], ...]


class Path(NamedTuple):
    """A line, or a filled outline, fixed in a frame; `width` is its size out of the plane, m, 0 for a symbol."""

    frame: str
    ink: str
    points: Points
    closed: bool = False
    width: float = 0.0


class Disc(NamedTuple):
    """A disc fixed in a frame."""

    frame: str
    ink: str
    centre: tuple[float, float]
    radius: float


class Span(NamedTuple):
    """A line stretched from one frame to another: (fraction of the distance, m to the left of it)."""

    frame: str
    other: str
    ink: str
    points: Points


class Strip(NamedTuple):
    """A flexible link, by its name."""

    link: str
    ink: str


class Arrow(NamedTuple):
    """A force at a frame, by its signals: two components, or one along a direction fixed in the frame `within`."""

    frame: str
    ink: str
    signals: tuple[str, ...]
    along: tuple[float, float] = (0.0, 0.0)
    within: str = ""


class Label(NamedTuple):
    """A name beside a place fixed in a frame; `what` is 'point', 'link' or 'symbol'."""

    frame: str
    text: str
    place: tuple[float, float]
    what: str


Mark = Path | Disc | Span | Strip | Arrow | Label
KINDS: dict[str, Any] = {kind.__name__: kind for kind in (Path, Disc, Span, Strip, Arrow, Label)}
"""Marks by name, as files keep them."""


class Ink(NamedTuple):
    """Colour of a line and of what it encloses ('' for none), width of the line, pt."""

    line: str
    fill: str
    width: float


LINKS = ("#0072B2", "#D55E00", "#009E73", "#A8508A", "#8A6D00", "#2B7DA8")
TINTS = ("#BBD7EA", "#F4CDB2", "#B5DFD1", "#EACFE1", "#F0E0B0", "#CDE6F5")
INKS: dict[str, Ink] = {
    "ground": Ink("#5A6672", "", 1.0),
    "support": Ink("#39434D", "#DDE2E7", 1.0),
    "rail": Ink("#9AA5B0", "", 1.0),
    "pin": Ink("#1B2733", "#FFFFFF", 1.2),
    "bush": Ink("#1B2733", "#FFF3C9", 1.2),
    "block": Ink("#1B2733", "#E4E9EE", 1.2),
    "stop": Ink("#6B2D12", "#C98A6B", 1.2),
    "spring": Ink("#4B5560", "", 1.2),
    "load": Ink("#B3261E", "", 1.6),
    "drive": Ink("#1B5FAA", "", 1.6),
    "motor": Ink("#1B5FAA", "#E3EEFA", 1.4),
    "mass": Ink("#1B2733", "#1B2733", 0.8),
    "other": Ink("#6B7680", "#F1F3F5", 1.2),
    "force": Ink("#B3261E", "#B3261E", 1.6),
    **{f"link{k}": Ink(line, fill, 1.2) for k, (line, fill) in enumerate(zip(LINKS, TINTS, strict=True))},
}
"""Colours by what a mark stands for; links take theirs in turn. Lines keep 3 : 1 against white."""


def packed(mark: Mark) -> list[Any]:
    """A mark as a list that JSON can hold."""
    return [type(mark).__name__, *mark]


def unpacked(row: list[Any]) -> Mark:
    """The mark that `packed` made a list of."""
    name, *values = row
    mark: Mark = KINDS[name](*(_tuples(value) for value in values))
    return mark


def _tuples(value: object) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list | tuple) else value
