"""A result in one .npz file, readable without this package: arrays by name, and all else as JSON in `head`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from ..elements.signal import Kind, Trait
from ..geometry import Array
from ..offers import find_offer
from .errors import Errors, Status


@dataclass(frozen=True)
class Shape:
    """A flexible link at chosen times.

    Attributes
    ----------
    times : array, shape (times,)
        s.
    points : array, shape (times, stations, 2)
        Positions along the link, m.
    thickness : float
        In the plane, m.
    """

    times: Array
    points: Array
    thickness: float


def write(result: Any, path: str | Path) -> Path:
    """Write a `Result`; the file's ending is .npz."""
    path = Path(path)
    path = path if path.suffix == ".npz" else path.with_name(path.name + ".npz")
    head = {name: getattr(result, name) for name in ("status", "message", "units", "work", "provenance", "asked", "verified")}
    head["traits"] = {name: list(trait) for name, trait in result.traits.items()}
    head |= {"error": result.error.plain(), "thickness": {name: shape.thickness for name, shape in result.shapes.items()}}
    arrays: dict[str, Array] = {"time": result.time, "head": np.array(json.dumps(head, default=str))}
    arrays |= {f"signal/{k}": v for k, v in result.signals.items()} | {f"energy/{k}": v for k, v in result.energy.items()}
    for name, shape in result.shapes.items():
        arrays |= {f"shape/{name}/times": shape.times, f"shape/{name}/points": shape.points}
    if result.film is not None:
        arrays |= {f"movie/{k}": v for k, v in result.film.movie().arrays().items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(path, **arrays)  # type: ignore[arg-type]
    return path


def read(path: str | Path) -> dict[str, Any]:
    """Return the fields of the `Result` that a file holds.

    Raises
    ------
    ValueError
        If the file holds no result.
    """
    data = np.load(Path(path), allow_pickle=False)
    if not isinstance(data, np.lib.npyio.NpzFile):
        raise ValueError(f"{path}: not a saved result (a single array)")
    with data:
        head = json.loads(str(data["head"])) if "head" in data.files else {}
        if not {"status", "message", "units", "work", "thickness", "provenance"} <= set(head):
            raise ValueError(f"{path}: not a saved result (no 'head' of one)")
        arrays = {name: data[name] for name in data.files if name != "head"}
    shapes = {
        name: Shape(arrays[f"shape/{name}/times"], arrays[f"shape/{name}/points"], thickness)
        for name, thickness in head["thickness"].items()
    }
    return {name: head[name] for name in ("message", "units", "work", "provenance")} | {
        "status": Status(head["status"]),
        "time": arrays["time"],
        "signals": _group(arrays, "signal/"),
        "energy": _group(arrays, "energy/"),
        "shapes": shapes,
        "asked": head.get("asked", nan),
        "error": _errors(head),
        "film": _film(_group(arrays, "movie/")),
        "verified": head.get("verified", nan),
        "traits": {name: Trait(Kind(kind), *rest) for name, (kind, *rest) in head.get("traits", {}).items()},
    }


def _errors(head: Mapping[str, Any]) -> Errors:
    """Return the errors that a file holds; a file of an older version has one number, the error of the motion."""
    found = head.get("error", nan)
    return Errors.of(found) if isinstance(found, dict) else Errors(float(found), {}, head.get("error_kind", ""))


def _film(arrays: Mapping[str, Array]) -> Any:
    """Return the film a file holds, if it does."""
    if not arrays:
        return None
    return find_offer("film_of")(arrays)


def _group(arrays: Mapping[str, Array], prefix: str) -> dict[str, Array]:
    """Return the arrays whose names begin with a prefix, by the rest of their names."""
    return {name.removeprefix(prefix): value for name, value in arrays.items() if name.startswith(prefix)}
