"""The report page of a run: one file, no network. Arrays are quantised to 16 bits and packed in base64."""

from __future__ import annotations

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
from ..offers import find_offer
from ..record.result import Result
from ..record.run import ledger
from .drawing import INKS, Arrow
from .movie import Movie, make_movie
from .verdicts import facts, summary, verdicts

MOTION = 190_000
"""Largest number of bytes of the motion, to which base64 adds a third."""
SIGNALS = 180_000
"""Largest number of bytes of the signals, to which base64 adds a third."""
BINS = (40, 800)
"""Least and largest number of bins of a signal."""
LONGEST = 20_000
"""Samples of a run up to which its energy ledger is computed for the page if it was not requested."""
LEVELS = 65534
"""Steps of a quantised value over its range; one more represents values that are not finite."""


def write_html(result: Result, path: str | Path, title: str = "") -> Path:
    """Write the report; see `Result.write_html`."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page(result, title or (path.stem if path.stem != "report" else path.resolve().parent.name)), encoding="utf-8")
    return path


def notebook_frame(result: Result) -> str:
    """Return the report in a frame of a notebook."""
    text = html.escape(page(result, "run"))
    return f'<iframe style="width:100%;height:760px;border:1px solid #ccd3da" srcdoc="{text}"></iframe>'


def page(result: Result, title: str, texts: Sequence[str] = ()) -> str:
    """Write the whole page as text; `texts` are its readings, by default the peaks of forces, torques and deflections."""
    return fill_page(__package__, "report", content(with_ledger(result), title, texts))


def content(result: Result, title: str, texts: Sequence[str] = ()) -> dict[str, Any]:
    """Collect the data of a page for its script."""
    store, read = ArrayStore(), find_offer("measures")(result, texts)  # `measures` of a higher package, bound by name
    wanted = [name for each in read for name in each.signals] if texts else []
    data = {
        "title": title,
        "status": str(result.status),
        "ok": bool(result.ok),
        "message": result.message,
        "summary": summary(result),
        "finished": result.status.finished,
        "notes": list(result.provenance.get("notes", ())),
        "measures": [_plain(each) for each in read],
        "checks": [row._asdict() for row in verdicts(result)],
        "facts": facts(result),
        "inks": {name: ink._asdict() for name, ink in INKS.items()},
        "motion": _motion(result, store),
        "signals": _signals(result, store, first_shown(result, wanted)),
    }
    return data | {"store": store.text()}


def blank(title: str) -> dict[str, Any]:
    """Collect the data of a page whose run has not begun."""
    lists: dict[str, Any] = {name: [] for name in ("notes", "measures", "checks", "facts")}
    none = {"motion": None, "signals": {"bins": 0, "rows": [], "first": []}, "inks": {}, "store": ""}
    return {"title": title, "status": "OK", "ok": True, "finished": True, "message": "", "summary": "", **lists, **none}


def _plain(measure: Any) -> dict[str, Any]:
    """Convert a measure for JSON; numbers that are not finite become null."""
    content = measure._asdict() | {"relative": measure.relative}
    return {key: None if isinstance(value, float) and not isfinite(value) else value for key, value in content.items()}


def with_ledger(result: Result) -> Result:
    """Return the result with its energy ledger, if its record has the data for it."""
    record = result.film.record if result.film is not None else None
    if result.energy or record is None or not 1 < len(record.time) <= LONGEST:
        return result
    return replace(result, energy=ledger(record))


class ArrayStore:
    """Concatenated arrays of 16-bit numbers."""

    def __init__(self) -> None:
        self.parts: list[Array] = []
        self.size = 0

    def add(self, values: Array, low: float | None = None, high: float | None = None) -> list[float]:
        """Append an array; return where it starts (-1 if all values are equal), its least value, the size of a step."""
        values = np.asarray(values, dtype=float).ravel()
        fine = np.isfinite(values)
        known = values[fine]
        low = float(known.min(initial=np.inf)) if low is None else low
        high = float(known.max(initial=-np.inf)) if high is None else high
        if not len(known):
            low = high = 0.0
        if low == high and fine.all():
            return [-1, low, 0.0]
        step = float(f"{(high - low) / LEVELS or 1.0:.9g}")  # few digits, for a short page
        whole = np.full(len(values), LEVELS + 1, dtype="<u2")
        whole[fine] = np.clip(np.rint((known - low) / step), 0, LEVELS)
        start = self.size
        self.parts.append(whole)
        self.size += len(whole)
        return [start, low, step]

    def text(self) -> str:
        """Return all of it in base64."""
        return b64encode(np.concatenate(self.parts).tobytes()).decode("ascii") if self.parts else ""


# --- motion -----------------------------------------------------------------------------------------------------------


def _motion(result: Result, store: ArrayStore) -> dict[str, Any] | None:
    if result.film is None:
        return None
    movie = _short(result)
    names = list(movie.frames)
    index = {name: k for k, name in enumerate(names)}
    marks = []
    for mark in movie.marks:
        if isinstance(mark, Arrow) and not all(name in result.signals for name in mark.signals):
            continue
        row = [type(mark).__name__, *map(_round, mark)]
        row[1] = index.get(row[1], row[1])  # frames of a mark, by number
        if row[0] == "Span":
            row[2] = index[row[2]]
        if row[0] == "Arrow":
            row[5] = index[row[5]]
        marks.append(row)
    bands = {}
    for name, band in movie.bands.items():  # bending and axial strain apart, so that the page can show curvature or stress
        known = {"stations": band.points.shape[1], "thickness": band.thickness, "modulus": band.modulus}
        parts = {"x": band.points[..., 0], "y": band.points[..., 1], "bending": band.bending, "axial": band.axial}
        bands[name] = known | {key: store.add(values) for key, values in parts.items()}
    return {
        "count": len(movie.time),
        "time": store.add(movie.time),
        "unit": movie.unit,
        "box": movie.box,
        "names": names,
        "points": movie.points,
        "frames": [[store.add(frame[:, axis]) for axis in range(3)] for frame in movie.frames.values()],
        "bands": bands,
        "marks": marks,
    }


def _short(result: Result) -> Movie:
    """Return the movie with as many pictures as fit: one has two bytes for the time, each moving axis and 4 values a station."""
    movie: Movie = result.film.movie()
    stations = sum(band.points.shape[1] for band in movie.bands.values())
    moving = sum(int(np.ptp(frame[:, axis]) > 0) for frame in movie.frames.values() for axis in range(3))
    most = max(60, int(MOTION / (2 * (4 * stations + moving + 1))))
    if len(movie.time) <= most or result.film.record is None:
        return movie
    return make_movie(result.film.record, np.linspace(movie.time[0], movie.time[-1], most))


def _round(value: object) -> Any:
    """Round the numbers of a mark to the resolution of a screen."""
    if isinstance(value, float):
        return float(f"{value:.5g}")
    return tuple(map(_round, value)) if isinstance(value, tuple) else value


# --- signals ----------------------------------------------------------------------------------------------------------


def _signals(result: Result, store: ArrayStore, first: Sequence[str]) -> dict[str, Any]:
    """Return each signal at the edges of bins, with its least and largest value in each bin."""
    rows = [(name, values, result.units.get(name, "")) for name, values in result.signals.items()]
    rows += [(f"energy {name}", values, "J") for name, values in result.energy.items()]
    time = result.time
    if len(time) < 2 or not rows:
        return {"bins": 0, "rows": []}
    bins = int(np.clip(SIGNALS / 6 / len(rows), *BINS))  # three numbers of two bytes each
    edges = np.linspace(time[0], time[-1], bins + 1)
    block = np.array([values for _, values, _ in rows], dtype=float)
    block[~np.isfinite(block)] = np.nan
    at, low, high = bin_extremes(time, block, edges)
    kept = []
    for k, (name, _, unit) in enumerate(rows):
        inside = block[k][np.isfinite(block[k])]
        limits = (float(inside.min(initial=np.inf)), float(inside.max(initial=-np.inf))) if len(inside) else (0.0, 0.0)
        parts = [store.add(part[k], *limits) for part in (at, low, high)]
        kept.append({"name": name, "unit": unit, "at": parts[0], "low": parts[1], "high": parts[2], "limits": limits})
    return {"bins": bins, "start": float(time[0]), "end": float(time[-1]), "rows": kept, "first": list(first)}


def bin_extremes(time: Array, values: Array, edges: Array) -> tuple[Array, Array, Array]:
    """Return values (signals, bins + 1) at the edges of bins, and the least and largest (signals, bins), edges among them.

    Values are (signals, samples); edges reach from the first to the last time [s].
    """
    k = np.clip(np.searchsorted(time, edges, side="right") - 1, 0, len(time) - 2)
    share = np.clip((edges - time[k]) / np.maximum(time[k + 1] - time[k], 1e-300), 0.0, 1.0)
    at = values[:, k] * (1 - share) + values[:, k + 1] * share
    starts = np.minimum(np.searchsorted(time, edges[:-1]), len(time) - 1)
    full = np.searchsorted(time, edges[1:], side="right") > starts
    low, high = (np.where(full, spread.reduceat(values, starts, axis=1), np.nan) for spread in (np.fmin, np.fmax))
    low = np.fmin(low, np.fmin(at[:, :-1], at[:, 1:]))
    return at, low, np.fmax(high, np.fmax(at[:, :-1], at[:, 1:]))


FIRST = (
    "contact_force", "normal_force", "torque", "current", "force", "deflection", "axial_force", "compression", "x", "y", "vx",
)  # fmt: skip
"""Last parts of the names of signals worth a first look, best first."""


def first_shown(result: Result, wanted: Sequence[str] = ()) -> list[str]:
    """Name the first three signals of the readings; without readings those that change most, one of each quantity."""
    if wanted:
        return list(dict.fromkeys(wanted))[:3]
    best: dict[str, tuple[float, str]] = {}
    for name, values in result.signals.items():
        ending, inside = name.rpartition(".")[2], values[np.isfinite(values)]
        if ending in FIRST and len(inside) and np.ptp(inside) > best.get(ending, (0.0, ""))[0]:
            best[ending] = (float(np.ptp(inside)), name)
    return ([best[ending][1] for ending in FIRST if ending in best] or list(result.signals))[:3]


# --- pages ------------------------------------------------------------------------------------------------------------


def fill_page(package: str, name: str, content: dict[str, Any]) -> str:
    """Return a page as text, of `page/name.html`, `.css` and `.js` of a package, with its data, among them `title` and `status`.

    Styles and script of the run's report come before those of the page; the report's body replaces `{{report}}` of the page. The
    title of the window tells the status unless it is OK.
    """
    mark = "" if content["status"] == "OK" else f"\u25b2 {content['status']}: "
    both = dict.fromkeys(((__package__, "report"), (package, name)))
    parts = {
        "title": html.escape(mark + content["title"]),
        "styles": "".join(_part(where, f"{part}.css") for where, part in both),
        "body": _part(package, f"{name}.html").replace("{{report}}", _part(__package__, "report.html")),
        "script": "".join(_part(where, f"{part}.js") for where, part in both),
        "data": json.dumps(content, separators=(",", ":"), allow_nan=False, default=str).replace("<", "\\u003c"),
    }
    text = _part(__package__, "shell.html")
    for key, part in parts.items():
        text = text.replace("{{" + key + "}}", part)
    return text


@cache
def _part(package: str, name: str) -> str:
    return files(package).joinpath("page", name).read_text(encoding="utf-8")
