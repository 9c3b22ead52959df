"""One case of a sweep that has ended, and how it is written in a store."""

from __future__ import annotations

import hashlib
import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import Any

import numpy as np

from ..kit.parameters import StudyParameters
from ..kit.report import Metric, plain


@dataclass(frozen=True)
class Row:
    """One case that has ended.

    Attributes
    ----------
    number : its place in the plan, from 0
    parameters : all of them, in the study's units; several values as a list
    status : the study's own ("OK", "SUSPECT", ...), "ERROR" for what it raised, "CRASHED" if its process died each time
    message : why it is not OK
    metrics : dict of Metric
    work : dict
    wall_s : run time of the case in its worker, s
    provenance : versions, sources (hash), host and ended
    signals : the content of an npz file; `arrays` reads it
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


def report_name(parameters: Mapping[str, object]) -> str:
    """File name of a case's own report page: the same for equal parameters."""
    return f"{hashlib.sha256(to_json(parameters).encode()).hexdigest()[:12]}.html"


def to_json(content: object) -> str:
    """Strict JSON, which SQLite's own functions read, that keeps every float: NaN and infinities are words."""
    return json.dumps(plain(content, str), ensure_ascii=False, separators=(",", ":"), allow_nan=False)


FIELDS = tuple(each.name for each in fields(Row))
"""Names of what a case has: the columns of a store's table."""
KEPT_AS_JSON = ("parameters", "metrics", "work", "provenance")


def packed(row: Row) -> list[Any]:
    """A row as the columns have it."""
    content = {**vars(row), "metrics": {name: asdict(metric) for name, metric in row.metrics.items()}}
    return [to_json(content[name]) if name in KEPT_AS_JSON else content[name] for name in FIELDS]


def unpacked(columns: Sequence[Any]) -> Row:
    """The row that `packed` made columns of."""
    content = {name: json.loads(each) if name in KEPT_AS_JSON else each for name, each in zip(FIELDS, columns, strict=True)}
    for name, each in content["metrics"].items():
        published, exact, error = (None if each[n] is None else float(each[n]) for n in ("published", "exact", "error"))
        content["metrics"][name] = Metric(float(each["value"]), each["unit"], published, exact, error)
    return Row(**content | {"wall_s": math.nan if content["wall_s"] is None else content["wall_s"]})
