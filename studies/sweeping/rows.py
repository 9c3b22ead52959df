"""One case of a sweep that has ended, and how it is written in a store."""

from __future__ import annotations

import hashlib
import io
import json
import math
import sqlite3
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from buckler.studies.kit.parameters import StudyParameters
from buckler.studies.kit.report import Metric, plain

COLUMNS = "number, parameters, status, message, metrics, work, wall_s, provenance"


@dataclass(frozen=True)
class Row:
    """One case that has ended.

    Attributes
    ----------
    number : int
        Its place in the plan, from 0.
    parameters : dict
        All of them, in the study's units; several values as a list.
    status : str
        The study's own ("OK", "SUSPECT", ...), "ERROR" for what it raised, "CRASHED" if its process died each time.
    message : str
        Why it is not OK.
    metrics : dict of Metric
    work : dict
    wall_s : float
        Run time of the case in its worker, s.
    provenance : dict
        versions, sources (hash), host and ended.
    signals : bytes, optional
        The content of an npz file; `arrays` reads it.
    """

    number: int
    parameters: Mapping[str, Any]
    status: str
    message: str = ""
    metrics: Mapping[str, Metric] = field(default_factory=dict)
    work: Mapping[str, Any] = field(default_factory=dict)
    wall_s: float = math.nan
    provenance: Mapping[str, Any] = field(default_factory=dict)
    signals: bytes | None = None

    def arrays(self) -> dict[str, np.ndarray]:
        """Its signals; none if they were not asked for."""
        if self.signals is None:
            return {}
        with np.load(io.BytesIO(self.signals)) as file:
            return dict(file)

    def value(self, metric: str) -> float:
        """Value of a metric, NaN if the case has none of that name."""
        return self.metrics[metric].value if metric in self.metrics else math.nan


def canonical(parameters: StudyParameters) -> str:
    """Parameters as JSON, equal for equal values however they were given."""
    return to_json(parameters.plain())


def report_name(parameters: Mapping[str, Any]) -> str:
    """File name of a case's own report page: the same for equal parameters."""
    return f"{hashlib.sha256(to_json(parameters).encode()).hexdigest()[:12]}.html"


def read_rows(connection: sqlite3.Connection, signals: bool = False) -> Iterator[Row]:
    """Every case that has ended, in the order of the plan, with its signals only if asked for."""
    columns = f"{COLUMNS}, {'signals' if signals else 'NULL'}"
    for row in connection.execute(f"SELECT {columns} FROM cases WHERE status IS NOT NULL ORDER BY number"):
        number, parameters, status, message, metrics, work, wall_s, provenance, content = row
        yield Row(
            number,
            json.loads(parameters),
            status,
            message,
            {name: _metric(metric) for name, metric in json.loads(metrics).items()},
            json.loads(work),
            math.nan if wall_s is None else wall_s,
            json.loads(provenance),
            content,
        )


def to_json(content: Any) -> str:
    """Strict JSON, which SQLite's own functions read, that keeps every float: NaN and infinities are words."""
    return json.dumps(plain(content, str), ensure_ascii=False, separators=(",", ":"), allow_nan=False)


def _metric(stored: Mapping[str, Any]) -> Metric:
    """A metric back from JSON."""
    published, exact, error = (None if stored[n] is None else float(stored[n]) for n in ("published", "exact", "error"))
    return Metric(float(stored["value"]), stored["unit"], published, exact, error)
