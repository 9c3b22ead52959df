"""Signals as tables: CSV, Parquet, data frames. Each library is asked for only where it is needed."""

from __future__ import annotations

import csv
import io
from collections.abc import Collection, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from ..record.result import Result


def needed(name: str, what: str, extra: str) -> ModuleType:
    """Import a library, or say what it is needed for and how to get it.

    Raises
    ------
    ImportError
        If it is not installed.
    """
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise ImportError(f"{what} needs {name}: pip install 'buckler[{extra}]'") from error


class Column(NamedTuple):
    """One column of a table; None where a row has no such value."""

    name: str
    unit: str
    values: Sequence[object]


def csv_of(columns: Sequence[Column], bare: Collection[str] = ("",)) -> bytes:
    """Columns as CSV, their units in the headers but for `bare` ones. Numbers keep every bit."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(column.name if column.unit in bare else f"{column.name} [{column.unit}]" for column in columns)
    writer.writerows(zip(*(column.values for column in columns), strict=True))
    return text.getvalue().encode()


def parquet_of(columns: Sequence[Column], what: str, about: Mapping[str, str]) -> bytes:
    """Columns as Parquet, their units in the metadata of the fields; `what` asks for it."""
    arrow, parquet = needed("pyarrow", what, "parquet"), needed("pyarrow.parquet", what, "parquet")
    arrays = [arrow.array(column.values) for column in columns]
    fields = [
        arrow.field(column.name, array.type, metadata={"unit": column.unit} if column.unit else None)
        for column, array in zip(columns, arrays, strict=True)
    ]
    sink = io.BytesIO()
    parquet.write_table(arrow.Table.from_arrays(arrays, schema=arrow.schema(fields, metadata=dict(about))), sink)
    return sink.getvalue()


def _written(path: str | Path, content: bytes) -> Path:
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return path


def _signals(result: Result) -> list[Column]:
    columns = [Column("t", "s", result.time.tolist())]
    return columns + [Column(key, result.units.get(key, "1"), np.asarray(v, float).tolist()) for key, v in result.signals.items()]


def write_csv(result: Result, path: str | Path) -> Path:
    """Write signals; see `Result.write_csv`. Numbers keep every bit."""
    return _written(path, csv_of(_signals(result)))


def write_parquet(result: Result, path: str | Path) -> Path:
    """Write signals; see `Result.write_parquet`."""
    about = {"status": str(result.status), "message": result.message}
    return _written(path, parquet_of(_signals(result), "write_parquet", about))


def to_dataframe(result: Result) -> Any:
    """Signals by time; see `Result.to_dataframe`. The frame's `attrs` hold units, status and message."""
    pandas = needed("pandas", "to_dataframe", "tables")
    frame = pandas.DataFrame(dict(result.signals), index=pandas.Index(result.time, name="t"))
    frame.attrs.update(units=dict(result.units), status=str(result.status), message=result.message)
    return frame


def to_xarray(result: Result) -> Any:
    """Signals with their units; see `Result.to_xarray`."""
    xarray = needed("xarray", "to_xarray", "tables")
    signals = {name: ("t", values, {"units": result.units.get(name, "1")}) for name, values in result.signals.items()}
    attributes = {"status": str(result.status), "message": result.message}
    return xarray.Dataset(signals, coords={"t": ("t", result.time, {"units": "s"})}, attrs=attributes)
