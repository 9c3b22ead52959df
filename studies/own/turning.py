"""`buckler sensitivity`, `fit`, `optimise`: numbers of a mechanism of a file turned, fitted to data, chosen."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from math import isnan
from pathlib import Path
from typing import Any, NamedTuple

from buckler.mbs.documents.document import changed
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.sensitivity.derivatives import sensitivities
from buckler.mbs.sensitivity.design import BUDGET
from buckler.mbs.sensitivity.design import optimise as designed
from buckler.mbs.sensitivity.fitting import fit as fitted
from buckler.mbs.sensitivity.numbers import DURATION, standing
from buckler.mbs.sensitivity.runs import RunFailedError, before_run
from buckler.mbs.units import parse_quantity

from ..kit.options import writable
from ..kit.report import counting
from ..kit.words import Command, add_repeated
from . import places
from .command import named

NOT_TURNED = ("elements", "points", "velocities", "gravity")
"""Parts of a document whose numbers are not turned unless they are named: whole numbers and places."""


class Opened(NamedTuple):
    """A mechanism of a file, and how the file says it is run."""

    document: dict[str, Any]
    duration: float
    measures: tuple[str, ...]


def opened(path: Path, changes: Sequence[str] = (), duration: str | None = None) -> Opened:
    """Read a file.

    Raises
    ------
    ValueError
        In one line with the file's name.
    """
    about = places.OPTIONS["duration"]
    with named(path):
        document, run = places.opened(path)
        seconds = run.get("duration", about.default) if duration is None else about.spec.read("--duration", duration)
        document = changed(document, places.set_all(document, list(changes)))
        Mechanism.from_dict(document)
    return Opened(document, seconds, run.get("measure", ()))


def command(declare: Callable[[argparse.ArgumentParser], Any], answer: Callable[[argparse.Namespace, Opened], int]) -> Command:
    """A command that turns numbers of a file: its own options behind those that all have; 1 if a run fails."""

    def declared(parser: argparse.ArgumentParser) -> None:
        parser.add_argument("file", metavar="FILE", type=Path, help="a mechanism, .toml or .json")
        add_repeated(parser, "--set", "PATH=VALUE", "another value at a place of the file", dest="changes")
        declare(parser)

    def answered(chosen: argparse.Namespace) -> int:
        try:
            return answer(chosen, opened(chosen.file, chosen.changes, getattr(chosen, "duration", None)))
        except RunFailedError as error:
            print(f"{chosen.file}: {error}", file=sys.stderr)
            return 1

    return Command(declared, answered)


@contextmanager
def _counted() -> Iterator[None]:
    """Show how many runs there were, where they take long enough to ask."""
    with counting("runs") as shown:
        token = before_run.set(shown)
        try:
            yield
        finally:
            before_run.reset(token)


def lasting(parser: argparse.ArgumentParser) -> None:
    """Declare how long the mechanism runs."""
    parser.add_argument("--duration", metavar="s", help="how long, s; default that of the file, or 1 s")


def _as_json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON and nothing else")


def _of_sensitivity(parser: argparse.ArgumentParser) -> None:
    lasting(parser)
    _as_json(parser)
    about = "a number, as links.coupler.body.section.thickness, with its standard deviation if the spread of readings is wanted"
    add_repeated(parser, "--by", "PATH[=SPREAD]", f"{about}; default all numbers that are not zero but places")
    about = "what is read off, as 'max(B.contact_force)', 'when(B.x, 0.1, 1)', 'frequency(1)'; default the measures of the file"
    add_repeated(parser, "--of", "READING", about)


def _sensitivity(chosen: argparse.Namespace, file: Opened) -> int:
    readings = list(dict.fromkeys(chosen.of or file.measures))
    if not readings:
        raise ValueError("--of: no reading; write for instance --of 'max(B.contact_force)'")
    source = file.document if chosen.by else Mechanism.from_dict(file.document)
    by = _spreads(file.document, chosen.by) if isinstance(source, dict) else list(numbers(source.to_dict()))
    with _counted():
        found = sensitivities(source, file.duration, by=by, of=readings)
    status = int(any(isnan(row.value) for row in found.rows))
    if chosen.json:
        rows = [row._asdict() | {"relative": row.relative, "relative_error": row.relative_error} for row in found.rows]
        print(json.dumps([_finite(row) for row in rows], indent=2))
        return status
    print(found)
    for reading in readings if found.spreads else ():
        parts = ", ".join(f"{path} {value:.3g}" for path, value in found.contributions(reading).items())
        print(f"{reading}: standard deviation {found.spread(reading):.4g}, of which {parts}")
    return status


def _of_fit(parser: argparse.ArgumentParser) -> None:
    _as_json(parser)
    add = parser.add_argument
    add("data", metavar="DATA.csv", type=Path, help="first column the time; units in brackets, as 'force [N]'")
    add_repeated(parser, "--signal", "[COLUMN=]NAME", "a signal of the mechanism and its column, by default of the same name")
    add_repeated(parser, "--free", "PATH=LOW:HIGH", "a number that is fitted")
    add_repeated(parser, "--own", "PATH=LOW:HIGH", "one that each experiment has of its own")
    add_repeated(
        parser, "--setting", "COLUMN", "a column that parts the experiments, and sets the number of this path if it is one"
    )
    add_repeated(parser, "--profile", "PATH", "a number whose profile likelihood is wanted")
    add("--robust", action="store_true", help="outliers count by their size and not by its square")
    add("--starts", type=int, default=8, help="points over the ranges from which the fit starts; default 8")
    add("--out", metavar="DIR", type=Path, default=Path("results"), help="where the page goes; default results")


def _fit(chosen: argparse.Namespace, file: Opened) -> int:
    if not chosen.signal:
        raise ValueError("--signal: none; write for instance --signal B.contact_force")
    if not chosen.free and not chosen.own:
        raise ValueError("--free: none; write for instance --free links.coupler.body.imperfection=-1mm:1mm")
    free = dict(number_range(file.document, text) for text in chosen.free)
    own = dict(number_range(file.document, text, "--own") for text in chosen.own)
    out = writable(chosen.out / f"{chosen.file.stem}-fit")
    with _counted():
        found = fitted(
            file.document, chosen.data, free=free, own=own, signals=chosen.signal, settings=chosen.setting,
            starts=chosen.starts, robust=chosen.robust, profiles=chosen.profile,
        )  # fmt: skip
    page = found.write_html(out / "report.html", f"{chosen.file.stem}: fit to {chosen.data.name}")
    if chosen.json:
        told = {each: getattr(found, each) for each in ("values", "intervals", "units", "unidentified", "rms")}
        print(json.dumps(told, indent=2))
        return 0
    print(found)
    print(f"data beside the fit: {page}")
    return 0


def _of_optimise(parser: argparse.ArgumentParser) -> None:
    lasting(parser)
    _as_json(parser)
    add = parser.add_argument
    add_repeated(parser, "--free", "PATH=LOW:HIGH", "a number; PATH=A,B,C for one of a list")
    add_repeated(parser, "--minimise", "READING", "as 'max(drive.torque)'; two of them for a front")
    about = "as 'max(B.contact_force) = 1.5 N ± 1 %%' or 'max(abs(coupler.deflection)) <= 30 mm'"
    add_repeated(parser, "--subject-to", "CONSTRAINT", about, dest="wants")
    add("--starts", type=int, default=8, help="points over the ranges from which the search starts; default 8")
    about = f"runs that a search may take, then the best so far is shown; default {BUDGET}"
    add("--budget", metavar="RUNS", type=int, default=BUDGET, help=about)


def _optimise(chosen: argparse.Namespace, file: Opened) -> int:
    if not chosen.free:
        raise ValueError("--free: none; write for instance --free links.coupler.body.section.thickness=0.2mm:0.5mm")
    free = dict(_range_or_list(file.document, text) for text in chosen.free)
    with _counted():
        found = designed(file.document, file.duration, free=free, minimise=chosen.minimise, subject_to=chosen.wants,
                         starts=chosen.starts, budget=chosen.budget)  # fmt: skip
    if chosen.json:
        told = {each.name: getattr(found, each.name) for each in fields(found) if each.name != "front"}
        print(json.dumps(told | {"front": [one.values | one.readings for one in found.front]}, indent=2))
    else:
        print("\n\n".join(map(str, found.front or [found])))
    return 0 if found.possible else 1


def number_range(document: Mapping[str, object], text: str, option: str = "--free") -> tuple[str, tuple[float, float]]:
    """A number's path and its range, as PATH=LOW:HIGH."""
    path, _, ends = text.partition("=")
    if ends.count(":") != 1:
        raise ValueError(f"{option} {text}: write PATH=LOW:HIGH, as links.coupler.body.imperfection=-1mm:1mm")
    low, high = _quantities(document, path, ends.split(":"), f"{option} {text}")
    if not low < high:
        raise ValueError(f"{option} {text}: low must be less than high")
    return path, (low, high)


def _range_or_list(document: Mapping[str, object], text: str) -> tuple[str, Sequence[float]]:
    """The same, or the list of its values, as PATH=A,B,C."""
    path, _, values = text.partition("=")
    if ":" in values or not values:
        return number_range(document, text)
    return path, _quantities(document, path, values.split(","), f"--free {text}")


def _quantities(document: Mapping[str, object], path: str, texts: Sequence[str], place: str) -> list[float]:
    """Values, SI, of a number of a document."""
    unit = "s" if path == DURATION else standing(document, path).unit
    try:
        return [parse_quantity(each, unit) for each in texts]
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from None


def _spreads(document: Mapping[str, object], texts: Sequence[str]) -> Any:
    """Numbers and, where they are given, their standard deviations."""
    pairs = [text.partition("=") for text in texts]
    if not any(equals for _, equals, _ in pairs):
        return [path for path, _, _ in pairs]
    found = {}
    for path, equals, value in pairs:
        if not equals:
            raise ValueError(f"--by {path}: no standard deviation, but others have one")
        found[path] = _quantities(document, path, [value], f"--by {path}={value}")[0]
    return found


def numbers(content: object, path: str = "") -> Iterator[str]:
    """Paths of all numbers of a document that are not zero, but places."""
    if isinstance(content, Mapping):
        for key, each in content.items():
            if key not in NOT_TURNED and not (path.startswith("guides") and key == "along"):
                yield from numbers(each, f"{path}.{key}" if path else key)
    elif isinstance(content, list):
        for k, each in enumerate(content):
            yield from numbers(each, f"{path}[{k}]")
    elif isinstance(content, float) and content:
        yield path


def _finite(row: Mapping[str, object]) -> dict[str, Any]:
    """A row without what JSON does not know."""
    return {key: None if isinstance(value, float) and not abs(value) < float("inf") else value for key, value in row.items()}


sensitivity = command(_of_sensitivity, _sensitivity)
fit = command(_of_fit, _fit)
optimise = command(_of_optimise, _optimise)
