"""The report page of a run: one HTML file that needs no network. Its arrays are quantised to 16 bits and stored in base64."""

import html
import json
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from importlib.resources import files
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from ..geometry import Array
from ..imports import import_late
from ..record.result import Result
from ..record.run import ledger
from .drawing import INKS, Arrow
from .movie import Movie, make_movie
from .verdicts import facts, summary, verdicts

MOTION = 190_000
"""Largest size of the quantised motion [bytes], a convention: with `SIGNALS`, and a third for base64, it makes 0.5 MB."""
SIGNALS = 180_000
"""Largest size of the quantised signals [bytes]."""
LEVELS = 65534
"""Largest quantised value; the one above it stands for values that are not finite."""
NO_SIGNALS: dict[str, Any] = {"bins": 0, "rows": [], "first": []}
"""Data of the signals of a page without any."""


def write_html(result: Result, path: str | Path, title: str = "") -> Path:
    """Write the report page of a run; see `Result.write_html`."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    has_default_name = path.stem == "report"  # then the folder of the page tells the runs apart
    name = path.resolve().parent.name if has_default_name else path.stem
    path.write_text(page(result, title or name), encoding="utf-8")
    return path


def notebook_frame(result: Result) -> str:
    """Return the report page as HTML for a notebook."""
    text = html.escape(page(result, "run"))
    return f'<iframe style="width:100%;height:760px;border:1px solid #ccd3da" srcdoc="{text}"></iframe>'


def page(result: Result, title: str, texts: Sequence[str] = ()) -> str:
    """Return the report page as text; `texts` are the readings it shows, by default peaks of forces, torques and deflections."""
    return fill_page(__package__, "report", content(result, title, texts))


def content(result: Result, title: str, texts: Sequence[str] = ()) -> dict[str, Any]:
    """Collect the data that the script of the page shows."""
    store = ArrayStore()
    record = result.film.record if result.film is not None else None  # a pickled `Film` has no record, only its movie
    if not result.energy and record is not None and 1 < len(record.time) <= 20_000:  # more states make a page slow
        result = replace(result, energy=ledger(record))
    readings = import_late("sensitivity.reading_errors:list_readings")(result, texts)
    read_signals = [name for reading in readings for name in reading.signals] if texts else []
    return {
        "title": title, "status": str(result.status), "ok": bool(result.ok), "finished": result.status.finished,
        "message": result.message, "summary": summary(result), "notes": list(result.provenance.get("notes", ())),
        "readings": [_to_json(reading) for reading in readings],
        "checks": [row._asdict() for row in verdicts(result)], "facts": facts(result),
        "inks": {name: ink._asdict() for name, ink in INKS.items()},
        "motion": _motion(result, store),
        "signals": _signals(result, store, first_shown(result, read_signals)),
        "store": b64encode(store.data).decode("ascii"),  # last: the motion and the signals fill it
    }  # fmt: skip


def blank(title: str) -> dict[str, Any]:
    """Collect the data of a page whose run has not begun."""
    lists: dict[str, Any] = {name: [] for name in ("notes", "readings", "checks", "facts")}
    no_run = {"motion": None, "signals": NO_SIGNALS, "inks": {}, "store": ""}
    return {"title": title, "status": "OK", "ok": True, "finished": True, "message": "", "summary": "", **lists, **no_run}


def _to_json(reading: Any) -> dict[str, Any]:
    """Convert a `CheckedReading` for JSON; numbers that are not finite become null."""
    fields = reading._asdict().items()
    return {key: None if isinstance(value, float) and not isfinite(value) else value for key, value in fields}


class ArrayStore:
    """Concatenated arrays of 16-bit numbers."""

    def __init__(self) -> None:
        self.data = bytearray()

    def add(self, values: Array, limits: tuple[float, float] | None = None) -> list[float]:
        """Append an array, quantised from the low to the high limit, by default its own.

        Return the index of its first number, the low limit and the step. A constant array is not appended: its index is -1.
        """
        values = np.asarray(values, dtype=float).ravel()
        low, high = limits or find_limits(values)
        is_finite = np.isfinite(values)
        if low == high and is_finite.all():
            return [-1, low, 0.0]
        exact_step = (high - low) / LEVELS or 1.0  # 1: all finite values are equal, but some values are not finite
        step = float(f"{exact_step:.9g}")  # few digits, for a short page
        quantised = np.full(len(values), LEVELS + 1, dtype="<u2")
        quantised[is_finite] = np.clip(np.rint((values[is_finite] - low) / step), 0, LEVELS)
        start = len(self.data) // quantised.itemsize
        self.data += quantised.tobytes()
        return [start, low, step]


def find_limits(values: Array) -> tuple[float, float]:
    """Return the least and the largest finite value; zeros if there is none."""
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)


def _motion(result: Result, store: ArrayStore) -> dict[str, Any] | None:
    """Store the movie of a run; return what the page needs to draw it."""
    if result.film is None:
        return None
    movie = _movie_within_size(result)
    number = {name: k for k, name in enumerate(movie.frames)}
    marks = []
    for mark in movie.marks:
        if isinstance(mark, Arrow) and not all(name in result.signals for name in mark.signals):
            continue
        fields = mark._asdict()
        # the page knows frames by number: the `frame` of a mark, `other` of a `Span`, `within` of an `Arrow`
        frames = {key: number[fields[key]] for key in ("frame", "other", "within") if key in fields}
        marks.append([type(mark).__name__, *map(_round, (fields | frames).values())])
    bands = {}
    for name, band in movie.bands.items():  # with bending and axial strain the page can show curvature or stress
        sizes = {"stations": band.points.shape[1], "thickness": band.thickness, "modulus": band.modulus}
        parts = {"x": band.points[..., 0], "y": band.points[..., 1], "bending": band.bending, "axial": band.axial}
        bands[name] = sizes | {key: store.add(values) for key, values in parts.items()}
    return {
        "count": len(movie.time), "time": store.add(movie.time), "unit": movie.unit, "box": movie.box,
        "names": list(movie.frames), "points": movie.points,
        "frames": [[store.add(frame[:, axis]) for axis in range(3)] for frame in movie.frames.values()],  # x, y and angle
        "bands": bands, "marks": marks,
    }  # fmt: skip


def _movie_within_size(result: Result) -> Movie:
    """Return the movie, with fewer pictures, but 60 at least (chosen), if its arrays would exceed `MOTION`."""
    movie: Movie = result.film.movie()
    stations = sum(band.points.shape[1] for band in movie.bands.values())
    coordinates = sum(int(np.ptp(frame[:, axis]) > 0) for frame in movie.frames.values() for axis in range(3))
    numbers_per_picture = 4 * stations + coordinates + 1  # x, y, bending and axial strain of a station; the time
    most = max(60, int(MOTION / (2 * numbers_per_picture)))  # two bytes a number
    if len(movie.time) <= most or result.film.record is None:
        return movie
    return make_movie(result.film.record, np.linspace(movie.time[0], movie.time[-1], most))


def _round(value: object) -> Any:
    if isinstance(value, float):
        return float(f"{value:.5g}")  # as many digits as a screen resolves
    return tuple(map(_round, value)) if isinstance(value, tuple) else value


def _signals(result: Result, store: ArrayStore, first: Sequence[str]) -> dict[str, Any]:
    """Store each signal at the edges of bins, equal intervals of time, with least and largest value in each bin."""
    rows = [(name, values, result.units.get(name, "")) for name, values in result.signals.items()]
    rows += [(f"energy {name}", values, "J") for name, values in result.energy.items()]
    time = result.time
    if len(time) < 2 or not rows:
        return NO_SIGNALS
    bytes_per_bin = 6  # value at the edge, least, largest, of two bytes each
    bins = int(np.clip(SIGNALS / bytes_per_bin / len(rows), 40, 800))  # 40 and 800 are chosen
    edges = np.linspace(time[0], time[-1], bins + 1)
    samples = np.array([values for _, values, _ in rows], dtype=float)
    samples[~np.isfinite(samples)] = np.nan
    at, low, high = bin_extremes(time, samples, edges)
    stored = []
    for k, (name, _, unit) in enumerate(rows):
        limits = find_limits(samples[k])
        parts = [store.add(part[k], limits) for part in (at, low, high)]
        stored.append({"name": name, "unit": unit, "at": parts[0], "low": parts[1], "high": parts[2], "limits": limits})
    return {"bins": bins, "start": float(time[0]), "end": float(time[-1]), "rows": stored, "first": list(first)}


def bin_extremes(time: Array, values: Array, edges: Array) -> tuple[Array, Array, Array]:
    """Compute values at the edges of bins, (signals, bins + 1), and least and largest values in the bins, (signals, bins).

    `values` are (signals, samples), linear between samples; `edges` reach from the first to the last time [s]. A bin has the
    samples from its left edge to before its right edge, and the values at both edges.
    """
    k = np.clip(np.searchsorted(time, edges, side="right") - 1, 0, len(time) - 2)
    share = np.clip((edges - time[k]) / np.maximum(time[k + 1] - time[k], 1e-300), 0.0, 1.0)
    at = values[:, k] * (1 - share) + values[:, k + 1] * share
    first = np.minimum(np.searchsorted(time, edges[:-1]), len(time) - 1)  # number of each bin's first sample
    has_samples = np.append(np.diff(first) > 0, True)  # the last bin has the last sample
    # `reduceat` reduces the samples from each first one to the next; for a bin without samples it returns one of another bin
    low = np.where(has_samples, np.fmin.reduceat(values, first, axis=1), np.nan)
    high = np.where(has_samples, np.fmax.reduceat(values, first, axis=1), np.nan)
    return at, np.fmin(low, np.fmin(at[:, :-1], at[:, 1:])), np.fmax(high, np.fmax(at[:, :-1], at[:, 1:]))


FIRST = (
    "contact_force", "normal_force", "torque", "current", "force", "deflection", "axial_force", "compression", "x", "y", "vx",
)  # fmt: skip
"""Quantities whose signals the page shows first, in this order: last parts of the names of signals."""


def first_shown(result: Result, preferred: Sequence[str] = ()) -> list[str]:
    """Name three signals to show first: preferred ones or, without them, for each quantity the one of largest range."""
    if preferred:
        return list(dict.fromkeys(preferred))[:3]
    best: dict[str, tuple[float, str]] = {}
    for name, values in result.signals.items():
        quantity, (low, high) = name.rpartition(".")[2], find_limits(values)
        if quantity in FIRST and high - low > best.get(quantity, (0.0, ""))[0]:
            best[quantity] = (high - low, name)
    return ([best[quantity][1] for quantity in FIRST if quantity in best] or list(result.signals))[:3]


def fill_page(package: str, name: str, content: dict[str, Any]) -> str:
    """Fill a page with its data, among them `title` and `status`; the title of the window names the status unless it is OK.

    All pages have the frame `page/shell.html`. The body is the file `page/<name>.html` of the package. In that file `{{report}}`
    stands for the body of the report page. Styles and scripts (`.css`, `.js`) of the report page come before those of `name`.
    """
    warning = "" if content["status"] == "OK" else f"\u25b2 {content['status']}: "
    sources = dict.fromkeys(((__package__, "report"), (package, name)))
    parts = {
        "title": html.escape(warning + content["title"]),
        "styles": "".join(_read(*source, "css") for source in sources),
        "body": _read(package, name, "html").replace("{{report}}", _read(__package__, "report", "html")),
        "script": "".join(_read(*source, "js") for source in sources),
        "data": json.dumps(content, separators=(",", ":"), allow_nan=False, default=str).replace("<", "\\u003c"),
    }
    text = _read(__package__, "shell", "html")
    for key, part in parts.items():
        text = text.replace("{{" + key + "}}", part)
    return text


@cache
def _read(package: str, name: str, ending: str) -> str:
    return files(package).joinpath("page", f"{name}.{ending}").read_text(encoding="utf-8")
