"""Files of a result: figures, signals and metrics.json, strict JSON with the provenance. Each is written whole or not at all."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import IO, Any

import numpy as np

from .report import StudyResult, provenance
from .style import Figure, house_style


def write(result: StudyResult, folder: Path, figures: Mapping[str, Figure], trusted: bool = False) -> str:
    """Write signals.npz, figures, pages and, last, metrics.json, whose text is returned; the files of an earlier run go first.

    `trusted` records that failed checks were overridden; the status stays SUSPECT, with its reasons.
    """
    writers: dict[str, Callable[[IO[bytes]], object]] = {}
    if result.signals:
        signals: dict[str, Any] = dict(result.signals)
        writers["signals.npz"] = partial(np.savez_compressed, **signals)
    for name, figure in figures.items():
        # A PDF without its date is the same file for the same figure.
        for kind, details in {"png": None, "pdf": {"CreationDate": None}}.items():
            writers[f"{name}.{kind}"] = partial(figure.savefig, format=kind, metadata=details)
    for name, page in result.pages.items():
        writers[name] = partial(lambda text, file: file.write(text.encode()), page)
    _remove_earlier(folder)
    with house_style() if figures else nullcontext():
        for name, writer in writers.items():
            with atomic(folder / name) as file:
                writer(file)
    text = to_json(
        {
            "status": result.status,
            "message": result.message,
            **({"trusted": True} if trusted else {}),
            "metrics": {name: metric.plain() for name, metric in result.metrics.items()},
            "tables": [asdict(table) for table in result.tables],
            "work": result.work,
            "provenance": provenance(result.parameters),
            "files": list(writers),
        }
    )
    with atomic(folder / "metrics.json") as file:
        file.write(text.encode())
    return text


@contextmanager
def atomic(path: Path) -> Iterator[IO[bytes]]:
    """Open a file that appears under its name only once it is complete."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with temporary.open("wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def _remove_earlier(folder: Path) -> None:
    """Remove the files that the folder's metrics.json lists, so that no earlier figure stands beside new numbers."""
    with suppress(OSError, ValueError, LookupError, TypeError):
        for name in [*json.loads((folder / "metrics.json").read_text())["files"], "metrics.json"]:
            if Path(name).name == name:
                (folder / name).unlink(missing_ok=True)


def to_json(content: object) -> str:
    """Write strict JSON: numpy values as plain ones, NaN and infinity as null."""
    return json.dumps(plain(content, lambda _: None), indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def plain(content: object, beyond: Callable[[float], Any]) -> Any:
    """Convert content to values that JSON has, and each float that is not finite by `beyond`."""
    if isinstance(content, np.ndarray | np.generic):
        content = content.tolist()
    if isinstance(content, Mapping):
        return {str(key): plain(value, beyond) for key, value in content.items()}
    if isinstance(content, list | tuple | set):
        return [plain(value, beyond) for value in content]
    if isinstance(content, float) and not math.isfinite(content):
        return beyond(content)
    return content if isinstance(content, str | int | float | None) else str(content)
