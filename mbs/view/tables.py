"""Signals as tables: CSV, Parquet, data frames. Each library is asked for only where it is needed."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np


def needed(name: str, what: str, extra: str) -> ModuleType:
    """Import a library, or say what it is needed for and how to get it.

    Raises
    ------
    ImportError
        If it is not installed.
    """
    from importlib import import_module

    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise ImportError(f"{what} needs {name}: pip install 'buckler[{extra}]'") from error


def write_csv(result: Any, path: str | Path) -> Path:
    """Write signals; see `Result.write_csv`. Numbers keep every bit."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    columns = {"t": result.time, **result.signals}
    units = {"t": "s", **result.units}
    head = ",".join(_quoted(f"{name} [{units.get(name, '1')}]") for name in columns)
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, fmt="%.17g", delimiter=",", header=head, comments="", encoding="utf-8")
    return path


def _quoted(text: str) -> str:
    return '"' + text.replace('"', '""') + '"' if any(c in text for c in ',"\n') else text


def write_parquet(result: Any, path: str | Path) -> Path:
    """Write signals; see `Result.write_parquet`."""
    arrow, parquet = needed("pyarrow", "write_parquet", "parquet"), needed("pyarrow.parquet", "write_parquet", "parquet")
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    columns = {"t": result.time, **result.signals}
    units = {"t": "s", **result.units}
    fields = [arrow.field(name, arrow.float64(), metadata={"unit": units.get(name, "1")}) for name in columns]
    schema = arrow.schema(fields, metadata={"status": str(result.status), "message": result.message})
    parquet.write_table(arrow.table([np.asarray(v, dtype=float) for v in columns.values()], schema=schema), path)
    return path


def to_dataframe(result: Any) -> Any:
    """Signals by time; see `Result.to_dataframe`. The frame's `attrs` hold units, status and message."""
    pandas = needed("pandas", "to_dataframe", "tables")
    frame = pandas.DataFrame(dict(result.signals), index=pandas.Index(result.time, name="t"))
    frame.attrs.update(units=dict(result.units), status=str(result.status), message=result.message)
    return frame


def to_xarray(result: Any) -> Any:
    """Signals with their units; see `Result.to_xarray`."""
    xarray = needed("xarray", "to_xarray", "tables")
    signals = {name: ("t", values, {"units": result.units.get(name, "1")}) for name, values in result.signals.items()}
    attributes = {"status": str(result.status), "message": result.message}
    return xarray.Dataset(signals, coords={"t": ("t", result.time, {"units": "s"})}, attrs=attributes)
