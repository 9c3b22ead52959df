"""Sweeps of a mechanism from Python.

rows = sweep(mechanism, {"links.coupler.body.section.thickness": [2e-4, 3e-4]}, measure="max(B.contact_force)", duration=1.0)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

from buckler.mbs.mechanism import Mechanism

from ..kit.parameters import Cases
from ..kit.report import QUIET, Progress
from ..sweeping import sweep as cases
from ..sweeping.executors import Workers
from ..sweeping.report import Heading, page, summary, worst
from ..sweeping.rows import Row
from ..sweeping.table import points
from ..sweeping.vary import Grid, plan
from . import study
from .places import spec, to_json
from .study import Parameters


def sweep(
    mechanism: Mechanism,
    values: Mapping[str, Sequence[Any]],
    *,
    measure: str | Sequence[str] = (),
    duration: float,
    accuracy: float | None = None,
    ledger: bool = False,
    name: str = "mechanism",
    workers: int | Workers = 0,
    store: Path | None = None,
    signals: bool = False,
    retry: bool = False,
    progress: Progress = QUIET,
    report: Path | None = None,
) -> list[Row]:
    """Run a mechanism with other values at some of its places, each combined with each.

    Parameters
    ----------
    mechanism : Mechanism
    values : dict of str to sequence
        Places, as in a file (`links.coupler.body.section.thickness`, `stops.B.law.restitution`), and the values there: numbers
        in SI, or texts such as '0.3 mm'.
    measure : str or sequence of str
        What to read off each result; by default the peaks of all forces, torques and deflections.
    duration, accuracy, ledger
        As in `simulate`.
    name : str
        What a store calls the mechanism.
    workers, store, signals, retry, progress
        As in `buckler.studies.sweeping.sweep`.
    report : Path, optional
        Where to write a page with a table, maps and the numbers of each case.

    Returns
    -------
    rows : list of Row
        One a case, the last place varying fastest; `row.parameters`, `row.value(measure)`, `row.status`.

    Raises
    ------
    ValueError
        If a place, a value or a measure is wrong, before anything runs.
    """
    document = mechanism.to_dict()
    places = {path: spec(document, path) for path in values}
    base: dict[str, Any] = {"name": name, "document": to_json(document), "duration": duration, "accuracy": accuracy}
    base |= {"ledger": ledger, "measure": measure}
    grids = [Grid(path, tuple(places[path].spec.read(path, each) for each in found)) for path, found in values.items()]
    chosen = plan(Cases(lambda changes: Parameters(**base, changes=tuple(changes.items())), places), {}, grids)
    units, begin = {path: each.unit for path, each in places.items()}, perf_counter()
    rows = cases.sweep(
        study,
        chosen.cases,
        workers=workers,
        store=store,
        signals=signals,
        retry=retry,
        progress=progress,
        name=f"{name} {study.digest(to_json(document))}",
        units=units,
    )
    if report is not None:
        found = points(chosen, rows)
        told = Heading(name, worst(rows), summary(found, perf_counter() - begin), f"buckler run {name}.toml", True, [])
        report.write_text(page(told, chosen, found, units, report.parent), encoding="utf-8")
    return rows
