"""`buckler explore FILE`: a page on this machine in which a mechanism moves and its numbers have sliders.

The server answers this machine only, and only who knows the token in the page's address. It ends with the terminal.
"""

from __future__ import annotations

import argparse
import json
import secrets
import webbrowser
from collections.abc import Iterable, Mapping
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path
from threading import Event, Lock
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.documents import document as documents
from buckler.mbs.documents.document import changed
from buckler.mbs.documents.shorthand import expanded
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.process import compiler
from buckler.mbs.sensitivity.numbers import Family
from buckler.mbs.simulation import simulate
from buckler.mbs.solvers import Spectral
from buckler.mbs.validate import number

from ..kit.words import add_repeated
from .turning import Opened, command, lasting, number_range, numbers

HOST = "127.0.0.1"
PICTURES, FINE = 240, 10_000
"""Of a run; parts of the larger side of what moves, in which places are told: more than a screen has pixels."""
AROUND = (0.5, 2.0)
"""Range of a number that was not given one, relative to its value."""
LARGEST = 65536
"""Bytes of a request."""


class Slider(NamedTuple):
    """A number with its range, SI."""

    path: str
    value: float
    low: float
    high: float
    unit: str


class LateError(Exception):
    """A newer change waits for an answer."""


class Explorer:
    """A mechanism whose numbers are turned. One answer is made at a time; the one about an error gives way to the next change."""

    def __init__(self, path: Path, document: dict[str, Any], duration: float, free: Mapping[str, Any]) -> None:
        self.path, self.duration, self.lock, self.turned = path, duration, Lock(), Event()
        self.family = Family.of(document, free, {})
        self._known(free)
        self.sliders = [self._slider(name, ends) for name, ends in free.items()]

    def _known(self, names: Iterable[str]) -> None:
        if other := sorted(set(names) - set(self.family.values)):
            raise ValueError(f"{other[0]}: has no slider")

    def _slider(self, path: str, ends: tuple[float, float] | None) -> Slider:
        now, unit = self.family.values[path], self.family.units[path]
        low, high = ends or sorted(part * now for part in AROUND)
        if not low < high:
            raise ValueError(f"{path} = {now:g}: has no range of its own; give one, as --free {path}=LOW:HIGH")
        return Slider(path, float(number(path, now, low, high, unit)), low, high, unit)

    def answer(self, name: str, values: Mapping[str, Any]) -> dict[str, Any]:
        """What is asked for by name."""
        if name == "move":
            self.turned.set()
        with self.lock:
            if name == "move":
                self.turned.clear()
            found: dict[str, Any] = ANSWERS[name](self, values)
            return found

    def mechanism(self, values: Mapping[str, Any]) -> Mechanism:
        """With these values; those of other paths than the sliders' are refused."""
        self._known(values)
        return self.family.make({path: float(value) for path, value in values.items()})

    def moved(self, values: Mapping[str, object]) -> dict[str, Any]:
        """Run once and return the pictures; nothing has looked at the run's error yet."""
        begin = perf_counter()
        made = self.mechanism(values)
        result = simulate(made, self.duration, solver=Spectral() if compiler() else None)
        movie = result.movie
        rows = np.unique(np.linspace(0, len(movie.time) - 1, PICTURES).round().astype(int))
        left, right, bottom, top = movie.box
        lines, unit = {}, max(right - left, top - bottom) / FINE
        for link in made.links:
            band = movie.bands.get(link.name)
            carried = [point for point in link.carries if point in movie.frames]
            around = [link.start, link.end, *carried, *([link.start] if carried else [])]
            ends = np.stack([movie.frames[point][:, :2] for point in around], axis=1)
            lines[link.name] = np.rint((band.points if band else ends)[rows] / unit).astype(int).tolist()
        return {"time": movie.time[rows].tolist(), "lines": lines, "unit": unit, "box": movie.box, "status": str(result.status),
                "message": result.message, "seconds": perf_counter() - begin}  # fmt: skip

    def judged(self, values: Mapping[str, object]) -> dict[str, Any]:
        """Run as `buckler run` does, and return status and error; that it is late, where a number is turned before it is done."""

        def look(_: float) -> None:
            if self.turned.is_set():
                raise LateError

        try:
            result = simulate(self.mechanism(values), self.duration, progress=look)
        except LateError:
            return {"late": True}
        error = float(result.error.motion)
        return {"status": str(result.status), "message": result.message, "error": error if np.isfinite(error) else None}

    def saved(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Write the file with these values beside the one that was opened, never over another."""
        self.mechanism(values)
        content = changed(expanded(documents.read(self.path)), {path: float(value) for path, value in values.items()})
        number = 1
        while (out := self.path.with_name(f"{self.path.stem}-{number}{self.path.suffix}")).exists():
            number += 1
        return {"saved": str(documents.write(content, out))}

    def page(self) -> str:
        """The page as text."""
        text = files("buckler.studies.own").joinpath("page", "explore.html").read_text(encoding="utf-8")
        data = {"title": self.path.name, "sliders": [slider._asdict() for slider in self.sliders]}
        return text.replace("{{data}}", json.dumps(data).replace("<", "\\u003c"))


ANSWERS = {"move": Explorer.moved, "judge": Explorer.judged, "save": Explorer.saved}


def server(explorer: Explorer, port: int = 0) -> tuple[ThreadingHTTPServer, str]:
    """A server that is ready to serve, and the address of its page."""
    token = secrets.token_urlsafe(16)

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            if self._known() and self.path == f"/{token}/":
                self._send(HTTPStatus.OK, explorer.page(), "text/html; charset=utf-8")
            else:
                self._send(HTTPStatus.NOT_FOUND, "not found", "text/plain")

        def do_POST(self) -> None:
            name = self.path.removeprefix(f"/{token}/")
            length = int(self.headers.get("Content-Length") or 0)
            if not self._known() or name not in ANSWERS or not 0 < length <= LARGEST:
                self._send(HTTPStatus.NOT_FOUND, "not found", "text/plain")
                return
            try:
                found = explorer.answer(name, json.loads(self.rfile.read(length)))
            except (ValueError, OSError, ArithmeticError) as error:
                found = {"wrong": " ".join(str(error).split())}
            self._send(HTTPStatus.OK, json.dumps(found), "application/json")

        def _known(self) -> bool:
            """Whether the request names this machine: a page of another name that leads here gets nothing."""
            return self.headers.get("Host", "") == f"{HOST}:{made.server_port}"

        def _send(self, status: HTTPStatus, text: str, kind: str) -> None:
            body = text.encode()
            self.send_response(status)
            for key, value in (("Content-Type", kind), ("Content-Length", str(len(body))), ("Cache-Control", "no-store"),
                               ("Referrer-Policy", "no-referrer"), ("X-Content-Type-Options", "nosniff")):  # fmt: skip
                self.send_header(key, value)
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            """Say nothing."""

    made = ThreadingHTTPServer((HOST, port), Handler)
    made.daemon_threads = True
    return made, f"http://{HOST}:{made.server_port}/{token}/"


def _declare(parser: argparse.ArgumentParser) -> None:
    lasting(parser)
    about = "a number with a slider; default all that are not zero but places"
    add_repeated(parser, "--free", "PATH[=LOW:HIGH]", about)
    parser.add_argument("--port", type=int, default=0, help="of the server; default any that is free")
    parser.add_argument("--no-browser", action="store_true", help="print the address only")


def _serve(chosen: argparse.Namespace, file: Opened) -> int:
    """Serve the page until Ctrl-C."""
    free: dict[str, Any] = dict(number_range(file.document, text) if "=" in text else (text, None) for text in chosen.free)
    document = file.document if free else Mechanism.from_dict(file.document).to_dict()
    explorer = Explorer(chosen.file, document, file.duration, free or dict.fromkeys(numbers(document)))
    try:
        made, address = server(explorer, chosen.port)
    except (OSError, OverflowError) as error:
        raise ValueError(f"--port {chosen.port}: {getattr(error, 'strerror', None) or error}") from None
    print(f"{address}\nEnds with Ctrl-C.", flush=True)
    if not chosen.no_browser:
        webbrowser.open(address)
    with made, suppress(KeyboardInterrupt):
        made.serve_forever(poll_interval=0.2)
    return 0


explore = command(_declare, _serve)
