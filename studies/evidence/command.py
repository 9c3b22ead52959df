"""`buckler evidence`: run the items, keep what they found, write it into the pages; or check that both still hold.

Each item that has run is filed with a mark of the source it ran with, so that a command that was stopped goes on where it was.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from itertools import zip_longest
from math import hypot
from pathlib import Path
from typing import Any

from ..kit import registry
from ..kit.options import writable
from ..kit.report import atomic, to_json, write
from ..kit.running import attempt, drawn
from ..kit.words import Command, repeated, wrong_input
from ..sweeping.worker import sources
from .items import FILES, ITEMS, ROOT, Item, stored
from .pages import Quoted, fill, looked_up, pages, quoted, rounding, stale


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--quick", action="store_true", help="items of a few seconds alone")
    repeated(parser.add_argument, ["--only"], "NAME", "this item")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 with the numbers that differ")
    parser.add_argument("--data", metavar="DIR", type=Path, help="measurements that are not part of Buckler")
    parser.add_argument("--out", metavar="DIR", type=Path, default=Path("results"), help="where runs are kept; default results")
    parser.add_argument("-q", "--quiet", action="store_true", help="print what differs and nothing else")
    parser.set_defaults(json=False)


def evidence(options: argparse.Namespace) -> int:
    """Run, then keep or check; the exit status."""
    for name in options.only:
        if name not in ITEMS:
            raise ValueError(f"--only = {name}: must be one of {', '.join(ITEMS)}")
    if not FILES.is_dir():
        return wrong_input(ValueError(f"{FILES}: not there; `evidence` needs a checkout of Buckler, with its docs"))
    try:
        folder = writable(options.out / "evidence")
    except ValueError as error:
        return wrong_input(error)
    sources()  # of what is loaded now, though files may change while it runs
    chosen = _chosen(options)
    _tell(f"{len(chosen)} items, some {sum(_seconds(name) for name in chosen):.0f} s when last kept", options)
    wrong = [line for path in pages() for line in stale(path)] if options.check else []
    for name in chosen:
        _tell(f"{name}: some {_seconds(name):.0f} s", options)
        content = _found(name, ITEMS[name], folder, options)
        if options.check:
            wrong += differing(name, content)
        elif content["status"] == "ERROR":
            wrong.append(f"{name}: {content['message']}")
        else:
            _keep(name, ITEMS[name], content, folder)
    if not options.check:
        fill()
    for line in wrong:
        print(line, file=sys.stderr)
    _tell(f"evidence: {len(wrong)} numbers differ" if wrong else "evidence: every number holds", options)
    return 1 if wrong else 0


again = Command(_declare, evidence)


def _chosen(options: argparse.Namespace) -> list[str]:
    """Items to run; those whose data are not here are told."""
    names = [name for name in options.only or ITEMS if ITEMS[name].quick or not options.quick]
    absent = [name for name in names if ITEMS[name].needs_data and not options.data]
    if absent:
        _tell(f"{', '.join(absent)}: not run without --data DIR", options)
    return [name for name in names if name not in absent]


def differing(name: str, new: Mapping[str, object]) -> list[str]:
    """Numbers of all pages that a new run of their item does not give, a line each.

    A number holds if the new one is within half a unit of the last digit printed, or within two standard errors of the
    difference where runs tell their error. Times are not compared.
    """
    old = stored(name)
    wrong = (
        []
        if new["status"] == old.get("status")
        else [f"{name}: status {new['status']}, was {old.get('status')}: {new['message']}"]
    )
    for path in pages():
        for number in quoted(path.read_text(encoding="utf-8")):
            if number.item == name and not number.what.startswith("work@") and not number.form.endswith("~"):
                wrong += [f"{path.name}: {line}" for line in _apart(number, old, new)]
    return wrong


def _apart(number: Quoted, old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[str]:
    if number.what == "table":
        tables = [[cell for row in content["tables"][int(number.form)]["rows"] for cell in row] for content in (old, new)]
        pairs = zip_longest(*tables)
        yield from (
            f"{number} {number.form}: {was} was printed, a new run gives {now}" for was, now in pairs if not _alike(was, now)
        )
        return
    try:
        was, now = looked_up(old, number.what), looked_up(new, number.what)
    except LookupError:
        yield f"{number}: the new run has none"
        return
    if abs(now - was) > rounding(number) + 2 * hypot(*(_error(content, number.what) for content in (old, new))):
        yield f"{number}: {was:.6g} is printed as {number.text}, a new run gives {now:.6g}"


def _alike(was: object, now: object) -> bool:
    """Whether two cells of a table say the same: within two standard errors of the difference where they have them."""
    cells = [re.fullmatch(r"(-?[\d.]+) ± ([\d.]+)\D*", str(cell)) for cell in (was, now)]
    if None in cells:
        return bool(was == now)
    (a, e), (b, f) = ((float(cell[1]), float(cell[2])) for cell in cells if cell)
    return abs(a - b) <= 2 * hypot(e, f)


def _error(content: Mapping[str, Any], what: str) -> float:
    """Standard error of a value, in its unit, where the study estimates it; a distance from an exact value is none."""
    metric = content["metrics"].get(what, {})
    return 0.0 if "exact" in metric else abs(metric.get("value") or 0.0) * (metric.get("error") or 0.0)


def _found(name: str, item: Item, folder: Path, options: argparse.Namespace) -> dict[str, Any]:
    """What an item finds: read if it has run with this source and these settings, run if not."""
    study = registry.load(item.study)
    parameters = study.Parameters(**item.given, **({"data": str(options.data)} if item.needs_data else {}))
    mark = hashlib.sha256(f"{sources()}{parameters}".encode()).hexdigest()
    path = folder / name / "evidence.json"
    if path.exists():
        before: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if before["mark"] == mark:
            return before
    result, figures = drawn(study, attempt(study.run, parameters, options))
    content: dict[str, Any] = json.loads(write(result, writable(folder / name), figures))
    if item.needs_data:
        content["provenance"]["parameters"].pop("data")  # a place of this machine
    tables = json.loads(to_json([asdict(table) for table in result.tables]))
    content = {**content, "tables": tables, "mark": mark}
    with atomic(path) as file:
        file.write(to_json(content).encode())
    return content


def _keep(name: str, item: Item, content: Mapping[str, object], folder: Path) -> None:
    """Keep what an item found, and its pictures, beside the pages."""
    kept = {key: value for key, value in content.items() if key not in ("files", "mark")}
    with atomic(FILES / f"{name}.json") as file:
        file.write(to_json(kept).encode())
    for figure, picture in item.figures.items():
        (ROOT / "docs" / "figures" / f"{picture}.png").write_bytes((folder / name / f"{figure}.png").read_bytes())


def _seconds(name: str) -> float:
    return float(stored(name).get("work", {}).get("wall_s", 0.0))


def _tell(text: str, options: argparse.Namespace) -> None:
    if not options.quiet:
        print(text, flush=True)
