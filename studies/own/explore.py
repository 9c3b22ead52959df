"""`buckler explore FILE`: a local web page that shows a mechanism in motion, with sliders for its numbers.

The server answers only requests from this machine that have the token of the page's address. Ctrl-C ends it. A change of a slider
sends `move`: one fast run without an error estimate. The page then sends `judge`: a run with its error estimate.
"""

import argparse
import json
import secrets
import sys
import webbrowser
from collections.abc import Callable, Mapping
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import count
from math import isfinite
from pathlib import Path
from threading import Event, Lock
from time import perf_counter
from typing import Any

from buckler.mbs import Exudyn, Mechanism, Spectral, simulate
from buckler.mbs.documents import document as documents
from buckler.mbs.documents.shorthand import expand
from buckler.mbs.process import has_compiler
from buckler.mbs.sensitivity.numbers import Family
from buckler.mbs.units import parse_quantity, written_unit
from buckler.mbs.validate import number as check_range
from buckler.mbs.view.report import blank, content, fill_page

from ..kit.cli import add_repeated
from .files import VARIED_HELP, FileContent, file_command, read_changes, read_range, varied_numbers

HOST = "127.0.0.1"
OMITTED = ("along", "exponent", "near")
"""Keys of numbers that get a slider only if `--free` names them: directions, exponents, guesses of places."""


class LateError(Exception):
    """End of a run whose numbers have changed since it began."""


class Explorer:
    """Mechanism with sliders: `free` has their ranges (low, high) by path, None for the default; `changes` come from `--set`."""

    def __init__(
        self, path: Path, file: FileContent, free: Mapping[str, Any], changes: Mapping[str, Any], timeout: float | None = None
    ) -> None:
        self.path, self.duration, self.measures, self.timeout = path, file.duration, file.measures, timeout
        self.lock, self.changed = Lock(), Event()
        # `save` writes the units of the file and its table [run]; `file.document` has the changes, but lacks both.
        self.written = documents.change(expand(documents.read(path)), changes)
        self.family = Family.of(file.document, free)  # of mechanisms that differ in these numbers
        self.sliders = [self._slider(name, bounds) for name, bounds in free.items()]

    def _slider(self, path: str, bounds: tuple[float, float] | None) -> dict[str, Any]:
        """Describe a slider: value and range in SI, the unit in which the file writes the number, and that unit in SI."""
        now, unit = self.family.values[path], self.family.units[path]
        low, high = bounds or sorted((0.5 * now, 2.0 * now))  # default, chosen: half to double
        if not low < high:  # the default range of 0 is empty
            raise ValueError(f"{path} = {now:g}: has no range of its own; give one, as --free {path}=LOW:HIGH")
        check_range(path, now, low, high, unit)
        shown, factor = self._unit(path, unit)
        return {"path": path, "value": float(now), "low": low, "high": high, "unit": shown, "factor": factor}

    def _unit(self, path: str, unit: str) -> tuple[str, float]:
        """Find the unit in which the file writes a number, and that unit in SI; by default `unit` and 1."""
        try:
            text = documents.get(self.written, path)
        except (KeyError, ValueError):  # the file omits the entry
            return unit, 1.0
        shown = written_unit(text) if isinstance(text, str) else ""
        return (shown, parse_quantity(f"1 {shown}", unit)) if shown else (unit, 1.0)

    def answer(self, name: str, values: Mapping[str, Any]) -> dict[str, Any]:
        """Answer a request: the name is one of `ANSWERS`, the values of the sliders are by path, in SI.

        Requests are answered one at a time. A `move` sets `changed`, which stops a running `judge`, and clears it at its turn.
        """
        if name == "move":
            self.changed.set()
        with self.lock:
            if name == "move":
                self.changed.clear()
            return ANSWERS[name](self, values)

    def mechanism(self, values: Mapping[str, Any]) -> Mechanism:
        """Make the mechanism with these values; a ValueError names a path without a slider."""
        if without_slider := sorted(values.keys() - self.family.values.keys()):
            raise ValueError(f"{without_slider[0]}: has no slider")
        return self.family.make({path: float(value) for path, value in values.items()})

    def move(self, values: Mapping[str, object]) -> dict[str, Any]:
        """Run once and return what the page shows; the error of the run is unknown."""
        begin = perf_counter()
        # `simulate` runs a given solver once. Without a compiler the equations of `Spectral` are slow.
        solver = Spectral() if has_compiler() else Exudyn()
        result = simulate(self.mechanism(values), self.duration, solver=solver, progress=False)
        return content(result, self.path.name, self.measures) | {"seconds": perf_counter() - begin}

    def judge(self, values: Mapping[str, object]) -> dict[str, Any]:
        """Run as `buckler run` does and return what the page shows, with errors; or `late` if a number changes meanwhile."""

        def stop_late(_: float) -> None:
            """Raise a LateError if a slider has moved."""
            if self.changed.is_set():
                raise LateError

        try:
            result = simulate(self.mechanism(values), self.duration, timeout=self.timeout, progress=stop_late)
        except LateError:
            return {"late": True}
        error = float(result.error.motion)  # largest relative error of all places, RMS; nan if unknown
        return content(result, self.path.name, self.measures) | {"error": error if isfinite(error) else None}

    def save(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Write the file's content, with the changes of `--set` and these values, to a new file beside the opened one."""
        self.mechanism(values)  # raises for values that make none
        entries: dict[str, float | str] = {}
        for path, value in values.items():
            unit, factor = self._unit(path, self.family.units[path])
            entries[path] = float(value) if factor == 1.0 else f"{value / factor:.12g} {unit}"  # a bare number is in SI
        paths = (self.path.with_name(f"{self.path.stem}-{k}{self.path.suffix}") for k in count(1))
        out = next(path for path in paths if not path.exists())
        return {"saved": str(documents.write(documents.change(self.written, entries), out))}

    def page(self) -> str:
        """Return the page, as it is before the first run, as HTML."""
        return fill_page("buckler.studies.own", "explore", blank(self.path.name) | {"sliders": self.sliders})


ANSWERS: dict[str, Callable[..., dict[str, Any]]] = {"move": Explorer.move, "judge": Explorer.judge, "save": Explorer.save}
"""Answers to the requests of the page, by name."""


class Server(ThreadingHTTPServer):
    """Server that prints no traceback when a page was closed before its answer."""

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Print the traceback of an error, unless the connection is lost."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


def server(explorer: Explorer, port: int = 0) -> tuple[ThreadingHTTPServer, str]:
    """Make a server with a new token; return it with the address of its page."""
    token = secrets.token_urlsafe(16)

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            """Send the page."""
            if self._is_ours() and self.path == f"/{token}/":
                self._send(HTTPStatus.OK, explorer.page(), "text/html; charset=utf-8")
            else:
                self._send(HTTPStatus.NOT_FOUND, "not found", "text/plain")

        def do_POST(self) -> None:
            """Send the answer to a request of the page."""
            name = self.path.removeprefix(f"/{token}/")
            length = int(self.headers.get("Content-Length") or 0)
            if not self._is_ours() or name not in ANSWERS or not 0 < length <= 65536:  # all sliders take a few thousand
                self._send(HTTPStatus.NOT_FOUND, "not found", "text/plain")
                return
            try:
                found = explorer.answer(name, json.loads(self.rfile.read(length)))
            except (ValueError, OSError, ArithmeticError) as error:
                found = {"wrong": " ".join(str(error).split())}
            self._send(HTTPStatus.OK, json.dumps(found, default=str), "application/json")

        def _is_ours(self) -> bool:
            """Check that the request names this host, so that a foreign page whose name resolves to it is refused."""
            return self.headers.get("Host", "") == f"{HOST}:{made.server_port}"

        def _send(self, status: HTTPStatus, text: str, kind: str) -> None:
            body = text.encode()
            headers = {"Cache-Control": "no-store", "Referrer-Policy": "no-referrer", "X-Content-Type-Options": "nosniff"}
            with suppress(ConnectionError):  # the page was closed meanwhile
                self.send_response(status)
                for key, value in {"Content-Type": kind, "Content-Length": str(len(body)), **headers}.items():
                    self.send_header(key, value)
                self.end_headers()
                self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            """Print nothing."""

    made = Server((HOST, port), Handler)
    return made, f"http://{HOST}:{made.server_port}/{token}/"


def _declare(parser: argparse.ArgumentParser) -> None:
    add_repeated(parser, "--free", "PATH[=LOW:HIGH]", f"a number with a slider; default {VARIED_HELP}")
    parser.add_argument("--port", type=int, default=0, help="port of the server; default any that is free")
    parser.add_argument("--no-browser", action="store_true", help="print the address only")


def _serve(options: argparse.Namespace, file: FileContent) -> int:
    """Serve the page of a file until Ctrl-C."""
    if options.free:
        document, paths = file.document, options.free
    else:  # without parameters in the file, the document in full: numbers that the file omits have sliders, too
        document, paths = varied_numbers(file, OMITTED)
    free: dict[str, Any] = dict(read_range(document, text) if "=" in text else (text, None) for text in paths)
    changes = read_changes(file.document, options.changes)
    explorer = Explorer(options.file, file._replace(document=document), free, changes, options.timeout)
    try:
        made, address = server(explorer, options.port)
    except (OSError, OverflowError) as error:
        raise ValueError(f"--port {options.port}: {getattr(error, 'strerror', None) or error}") from None
    print(f"{address}\nEnds with Ctrl-C.", flush=True)
    if not options.no_browser:
        webbrowser.open(address)
    with made, suppress(KeyboardInterrupt):
        made.serve_forever(poll_interval=0.2)
    return 0


explore = file_command(_declare, _serve)
