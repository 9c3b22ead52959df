"""`buckler sensitivity`, `fit`, `optimise`: numbers of a mechanism of a file turned, fitted to data, chosen."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from buckler.mbs.documents.document import changed
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.sensitivity.derivatives import sensitivities
from buckler.mbs.sensitivity.design import optimise as designed
from buckler.mbs.sensitivity.fitting import fit as fitted
from buckler.mbs.sensitivity.frozen import RunFailedError
from buckler.mbs.sensitivity.numbers import DURATION, standing
from buckler.mbs.units import parse_quantity
from buckler.studies.kit.options import Parser, check_words, noted, wrong_input
from buckler.studies.own import places
from buckler.studies.own.command import DEFAULT_DURATION, named

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
    document, run = named(path, places.opened, path)
    given = run.get("duration", DEFAULT_DURATION) if duration is None else duration
    seconds = float(given) if isinstance(given, int | float) else named(path, parse_quantity, str(given), "s")
    measures = run.get("measure", [])
    document = changed(document, places.set_all(document, list(changes)))
    named(path, Mechanism.from_dict, document)
    return Opened(document, seconds, (measures,) if isinstance(measures, str) else tuple(map(str, measures)))


def common(prog: str, about: str) -> Parser:
    """Options that all commands have that turn numbers."""
    parser = Parser(prog=prog, description=about, allow_abbrev=False)
    add = parser.add_argument
    add("file", metavar="FILE", type=Path, help="a mechanism, .toml or .json")
    add("--duration", metavar="s", help="how long, s; default that of the file, or 1 s")
    add("--set", action="append", default=[], metavar="PATH=VALUE", dest="changes",
        help="another value at a place of the file; may be repeated")  # fmt: skip
    add("--json", action="store_true", help="print JSON and nothing else")
    return parser


def answered(parser: Parser, argv: Sequence[str], answer: Callable[[argparse.Namespace, Opened], int]) -> int:
    """Answer with the options and the file they name; the exit status: 2 if these are wrong, 1 if a run fails."""
    try:
        chosen, unknown = parser.parse_known_args(noted(argv))
        check_words(unknown, chosen)
        return answer(chosen, opened(chosen.file, chosen.changes, chosen.duration))
    except RunFailedError as error:
        print(f"{chosen.file}: {error}")
        return 1
    except BrokenPipeError:
        raise
    except (ValueError, OSError, OverflowError) as error:
        return wrong_input(ValueError(str(error)))


def sensitivity(argv: Sequence[str], prog: str) -> int:
    """Print derivatives of readings; the exit status."""
    parser = common(prog, "Derivatives of readings by the numbers of a mechanism, each with its error.")
    parser.add_argument("--by", action="append", default=[], metavar="PATH[=SPREAD]",
        help="a number, as links.coupler.body.section.thickness, with its standard deviation if the spread of readings is "
        "wanted; may be repeated; default all numbers that are not zero but places")  # fmt: skip
    parser.add_argument("--of", action="append", default=[], metavar="READING",
        help="what is read off, as 'max(B.contact_force)', 'when(B.x, 0.1, 1)', 'frequency(1)'; may be repeated; default the "
        "measures of the file")  # fmt: skip
    return answered(parser, argv, _sensitivity)


def _sensitivity(chosen: argparse.Namespace, file: Opened) -> int:
    readings = chosen.of or file.measures
    if not readings:
        raise ValueError("--of: no reading; write for instance --of 'max(B.contact_force)'")
    source = file.document if chosen.by else Mechanism.from_dict(file.document)
    by = _spreads(file.document, chosen.by) if isinstance(source, dict) else list(numbers(source.to_dict()))
    found = sensitivities(source, file.duration, by=by, of=readings)
    if chosen.json:
        rows = [row._asdict() | {"relative": row.relative, "relative_error": row.relative_error} for row in found.rows]
        print(json.dumps([_finite(row) for row in rows], indent=2))
        return 0
    print(found)
    for reading in readings if found.spreads else ():
        parts = ", ".join(f"{path} {value:.3g}" for path, value in found.contributions(reading).items())
        print(f"{reading}: standard deviation {found.spread(reading):.4g}, of which {parts}")
    return 0


def fit(argv: Sequence[str], prog: str) -> int:
    """Fit numbers to a file of data, print them and write a page; the exit status."""
    parser = common(prog, "Fit numbers of a mechanism to measured signals.")
    add = parser.add_argument
    add("data", metavar="DATA.csv", type=Path, help="first column the time; units in brackets, as 'force [N]'")
    add("--signal", action="append", default=[], metavar="[COLUMN=]NAME",
        help="a signal of the mechanism and its column, by default of the same name; may be repeated")  # fmt: skip
    add("--free", action="append", default=[], metavar="PATH=LOW:HIGH", help="a number that is fitted; may be repeated")
    add("--own", action="append", default=[], metavar="PATH=LOW:HIGH", help="one that each experiment has of its own")
    add("--setting", action="append", default=[], metavar="COLUMN",
        help="a column that parts the experiments, and sets the number of this path if it is one; may be repeated")  # fmt: skip
    add("--profile", action="append", default=[], metavar="PATH", help="a number whose profile likelihood is wanted")
    add("--robust", action="store_true", help="outliers count by their size and not by its square")
    add("--starts", type=int, default=8, help="points over the ranges from which the fit starts; default 8")
    add("--out", metavar="DIR", type=Path, default=Path("results"), help="where the page goes; default results")
    return answered(parser, argv, _fit)


def _fit(chosen: argparse.Namespace, file: Opened) -> int:
    if not chosen.signal:
        raise ValueError("--signal: none; write for instance --signal B.contact_force")
    free, own = (dict(number_range(file.document, text) for text in texts) for texts in (chosen.free, chosen.own))
    try:
        found = fitted(
            file.document, chosen.data, free=free, own=own, signals=chosen.signal, settings=chosen.setting,
            starts=chosen.starts, robust=chosen.robust, profiles=chosen.profile,
        )  # fmt: skip
    except KeyError as error:
        raise ValueError(error.args[0]) from None
    title = f"{chosen.file.stem}: fit to {chosen.data.name}"
    page = found.write_html(chosen.out / f"{chosen.file.stem}-fit" / "report.html", title)
    if chosen.json:
        told = {"values": found.values, "intervals": found.intervals, "unidentified": found.unidentified, "rms": found.rms}
        print(json.dumps(told, indent=2))
        return 0
    print(found)
    print(f"data beside the fit: {page}")
    return 0


def optimise(argv: Sequence[str], prog: str) -> int:
    """Choose numbers and print them; the exit status, 1 where the constraints cannot be kept."""
    parser = common(prog, "Choose numbers of a mechanism so that a reading is least and others lie where they are wanted.")
    add = parser.add_argument
    add("--free", action="append", default=[], metavar="PATH=LOW:HIGH", help="a number; PATH=A,B,C for one of a list; repeated")
    add("--minimise", action="append", default=[], metavar="READING", help="as 'max(drive.torque)'; two of them for a front")
    add("--subject-to", action="append", default=[], metavar="CONSTRAINT", dest="wants",
        help="as 'max(B.contact_force) = 1.5 N ± 1 %%' or 'max(abs(coupler.deflection)) <= 30 mm'; may be repeated")  # fmt: skip
    add("--starts", type=int, default=8, help="points over the ranges from which the search starts; default 8")
    return answered(parser, argv, _optimise)


def _optimise(chosen: argparse.Namespace, file: Opened) -> int:
    if not chosen.free:
        raise ValueError("--free: none; write for instance --free links.coupler.body.section.thickness=0.2mm:0.5mm")
    free = dict(number_range(file.document, text) for text in chosen.free)
    found = designed(file.document, file.duration, free=free, minimise=chosen.minimise, subject_to=chosen.wants,
                     starts=chosen.starts)  # fmt: skip
    if chosen.json:
        told = {key: getattr(found, key) for key in ("values", "binding", "readings", "changes", "possible", "message", "runs")}
        print(json.dumps(told | {"front": [one.values | one.readings for one in found.front]}, indent=2))
    else:
        print("\n\n".join(map(str, found.front or [found])))
    return 0 if found.possible else 1


def number_range(document: Mapping[str, Any], text: str) -> tuple[str, Any]:
    """A number's path and its range, as PATH=LOW:HIGH, or the list of its values, as PATH=A,B,C."""
    path, equals, ends = text.partition("=")
    low, colon, high = ends.partition(":")
    if not equals or not (colon or ends):
        raise ValueError(f"--free {text}: write PATH=LOW:HIGH, as links.coupler.body.imperfection=-1mm:1mm")
    unit = standing(document, path).unit
    try:
        if not colon:
            return path, [parse_quantity(each, unit) for each in ends.split(",")]
        return path, (parse_quantity(low, unit), parse_quantity(high, unit))
    except ValueError as error:
        raise ValueError(f"--free {text}: {error}") from None


def _spreads(document: Mapping[str, Any], texts: Sequence[str]) -> Any:
    """Numbers and, where they are given, their standard deviations."""
    pairs = [text.partition("=") for text in texts]
    if not any(equals for _, equals, _ in pairs):
        return [path for path, _, _ in pairs]
    found = {}
    for path, equals, value in pairs:
        if not equals:
            raise ValueError(f"--by {path}: no standard deviation, but others have one")
        unit = "s" if path == DURATION else standing(document, path).unit
        found[path] = parse_quantity(value, unit)
    return found


def numbers(content: Any, path: str = "") -> Iterator[str]:
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


def _finite(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row without what JSON does not know."""
    return {key: None if isinstance(value, float) and not abs(value) < float("inf") else value for key, value in row.items()}
