"""Sweeps of a mechanism from Python.

rows = sweep(mechanism, {"links.coupler.body.section.thickness": [2e-4, 3e-4]}, measure="max(B.contact_force)", duration=1.0)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from buckler.mbs.mechanism import Mechanism

from ..kit.parameters import Cases
from ..sweeping import sweep as cases
from ..sweeping.store import Row
from ..sweeping.vary import Axis, plan
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
    **options: Any,
) -> list[Row]:
    """Run a mechanism with other values at some of its places, each combined with each.

    Parameters
    ----------
    values : dict of str to sequence
        Places, as in a file (`links.coupler.body.section.thickness`, `stops.B.law.restitution`), and the values there: numbers
        in SI, or texts such as '0.3 mm'.
    measure : str or sequence of str
        Readings of each result; by default the peaks of all forces, torques and deflections.
    duration, accuracy, ledger
        As in `simulate`.
    name : str
        Name of the mechanism in a store.
    options
        workers, executor, store, part, retry, progress of `buckler.studies.sweeping.sweep`.

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
    axes = [Axis(path, tuple(places[path].spec.read(path, each) for each in found)) for path, found in values.items()]
    chosen = plan(Cases(lambda changes: Parameters(**base, changes=tuple(changes.items())), places), {}, axes)
    units = {path: each.unit for path, each in places.items()}
    return cases.sweep(study, chosen.cases, name=f"{name} {study.digest(to_json(document))}", units=units, **options)
