"""Result of a study: metrics with their errors, tables and signals; the files of a result; the progress of a run.

A file appears under its name only when it is complete. A study shows its progress by `for x in progress(cases, label="speed")`.
"""

import json
import math
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import IO, Any, TypeVar

import numpy as np

from buckler.mbs.progress import Forecast

from .parameters import StudyParameters
from .style import Figure, house_style
from .versions import versions

T = TypeVar("T")
P = TypeVar("P", bound=StudyParameters)


@dataclass(frozen=True)
class Metric:
    """Number that answers the question of a study; `published` and `exact` are known values of it."""

    value: float
    unit: str  # of value, published, exact and absolute; "1" for a number without unit
    published: float | None = None
    exact: float | None = None
    error: float | None = None  # relative, estimated by the study; by default the difference from `exact`, if that is not zero
    absolute: float | None = None  # absolute error, given instead of `error` where the value is zero or below its error

    def __post_init__(self) -> None:
        if self.error is None and self.exact:
            object.__setattr__(self, "error", abs(self.value - self.exact) / abs(self.exact))

    def plain(self) -> dict[str, Any]:
        """Return the value, and all other fields that are not None, by name."""
        return {key: value for key, value in asdict(self).items() if value is not None or key == "value"}

    @property
    def error_in_unit(self) -> float | None:
        """Absolute error, given or from the relative one, in the unit of the value."""
        return self.absolute if self.error is None else abs(self.value) * self.error

    def format(self, value: str = ".4g", error: str = ".2g") -> str:
        """Write value and `error_in_unit` in these formats, 12.3 ± 0.4; the value alone where no error is known."""
        return f"{self.value:{value}}" + ("" if self.error_in_unit is None else f" ± {self.error_in_unit:{error}}")


@dataclass(frozen=True)
class Table:
    """Table: rows under headers with units, and notes below."""

    headers: Sequence[str]
    rows: Sequence[Sequence[Any]]
    title: str = ""
    notes: str = ""

    def __str__(self) -> str:
        from tabulate import tabulate

        body = tabulate(self.rows, self.headers, tablefmt="simple", floatfmt=".6g")
        return "\n".join(part for part in (self.title, body, self.notes) if part)


@dataclass(frozen=True, kw_only=True)
class StudyResult:
    """Value that a study's `run` returns."""

    parameters: StudyParameters
    status: str = "OK"  # or "SUSPECT" for a run that ended but fails a check of its own, or the name of the failure
    message: str = ""  # sentence a person can act on; needed unless the status is "OK"
    metrics: Mapping[str, Metric] = field(default_factory=dict)
    signals: Mapping[str, np.ndarray] = field(default_factory=dict)  # for signals.npz, in SI
    work: Mapping[str, Any] = field(default_factory=dict)  # counts, as of steps; the time of the run, `wall_s` [s], is added
    tables: Sequence[Table] = ()  # printed instead of the table of metrics
    pages: Mapping[str, str] = field(default_factory=dict)  # contents of text files by file name, such as report.html
    units: Mapping[str, str] = field(default_factory=dict)  # of the signals, where they are known
    notes: Sequence[str] = ()  # remarks that are printed after the status

    def __post_init__(self) -> None:
        if self.status != "OK" and not self.message:
            raise ValueError(f"status = {self.status}: a message must say what went wrong")

    def __str__(self) -> str:
        return "\n\n".join(map(str, self.tables or ([metrics_table(self.metrics)] if self.metrics else [])))

    def of(self, kind: type[P]) -> P:
        """Return the parameters with their type, for type checkers; a TypeError if they are not of this kind."""
        if not isinstance(self.parameters, kind):
            raise TypeError(f"parameters: must be {kind.__module__}.{kind.__name__}")
        return self.parameters


def status_of(wrong: Sequence[str], message: str = "") -> dict[str, Any]:
    """Return status and message of a study: SUSPECT if any fault is listed in `wrong`, OK and `message` if none is."""
    return {"status": "SUSPECT" if wrong else "OK", "message": "; ".join(wrong) or message}


def worst(runs: Iterable[tuple[str, Any]], notes: Iterable[str] = ()) -> dict[str, Any]:
    """Return the worst status of runs, given as pairs of name and result, and all their messages with the notes."""
    wrong = [(name, run) for name, run in runs if run.status != "OK"]
    failures = [run.status for _, run in wrong if run.status != "SUSPECT"]
    status = failures[0] if failures else "SUSPECT" if wrong else "OK"
    return {"status": str(status), "message": "; ".join([*(f"{name}: {run.message}" for name, run in wrong), *notes])}


def metrics_table(metrics: Mapping[str, Metric]) -> Table:
    """Tabulate metrics, one a row, without empty columns; stresses are in MPa. An absolute error has ± and its unit."""
    rows = []
    for name, m in metrics.items():
        unit, factor = ("MPa", 1e-6) if m.unit == "Pa" else (m.unit, 1)
        value, published, exact = (None if x is None else factor * x for x in (m.value, m.published, m.exact))
        # an absolute error below 1e-300, such as a denormal number, is printed as 0
        absolute = None if m.absolute is None else f"± {round(factor * m.absolute, 300):.2g} {unit}"
        error = absolute if m.error is None else relative(m.error)
        rows.append((name, value, unit, published, exact, error))
    headers = ("metric", "value", "unit", "published", "exact", "relative error")
    kept = [i for i in range(len(headers)) if i < 3 or any(row[i] is not None for row in rows)]
    return Table([headers[i] for i in kept], [[row[i] for i in kept] for row in rows])


def relative(error: float) -> str:
    """Write a relative error in per cent, or in scientific notation below a thousandth."""
    return f"{error:.1e}" if error < 1e-3 else f"{100 * error:.2g} %" if error < 1 else f"{100 * error:.0f} %"


def collect_provenance(parameters: StudyParameters) -> dict[str, Any]:
    """Collect versions, commit, machine and parameters, which are needed to repeat a run."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    cpu = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.processor())
    machine = {"cpu": cpu, "cores": os.cpu_count(), "os": platform.platform()}
    return {"versions": versions(), "commit": _commit(), "machine": machine, "parameters": parameters.plain()}


def _commit() -> str | None:
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():  # installed, and `git describe` might find a repository that contains the installation
        return None
    command = ["git", "-C", str(root), "describe", "--always", "--tags", "--dirty=+dirty"]
    with suppress(OSError, subprocess.SubprocessError):
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
    return None


def write(result: StudyResult, folder: Path, figures: Mapping[str, Figure], is_allowed: bool = False) -> str:
    """Remove the files of an earlier run; write signals.npz, figures, pages and metrics.json; return the text of the last.

    `is_allowed` is True if the user accepts failed checks; status and message stay.
    """
    writers: dict[str, Callable[[IO[bytes]], object]] = {}
    if result.signals:
        signals: dict[str, Any] = dict(result.signals)
        writers["signals.npz"] = partial(np.savez_compressed, **signals)
    for name, figure in figures.items():
        # Without its date the PDF of an unchanged figure is the same file.
        for kind, details in {"png": None, "pdf": {"CreationDate": None}}.items():
            writers[f"{name}.{kind}"] = partial(figure.savefig, format=kind, metadata=details)
    for name, page in result.pages.items():
        writers[name] = partial(lambda text, file: file.write(text.encode()), page)
    _remove_earlier(folder)
    with house_style() if figures else nullcontext():
        for name, writer in writers.items():
            with atomic(folder / name) as file:
                writer(file)
    content: dict[str, Any] = {"status": result.status, "message": result.message}
    content |= {"trusted": True} if is_allowed else {}
    content["metrics"] = {name: metric.plain() for name, metric in result.metrics.items()}
    content |= {"tables": [asdict(table) for table in result.tables], "work": result.work}
    text = to_json(content | {"provenance": collect_provenance(result.parameters), "files": list(writers)})
    with atomic(folder / "metrics.json") as file:
        file.write(text.encode())
    return text


@contextmanager
def atomic(path: Path) -> Iterator[IO[bytes]]:
    """Open a temporary file that gets its name only when it is complete."""
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
    """Remove the files that metrics.json of an earlier run lists, so that none of its figures remains."""
    with suppress(OSError, ValueError, LookupError, TypeError):
        for name in [*json.loads((folder / "metrics.json").read_text())["files"], "metrics.json"]:
            if Path(name).name == name:
                (folder / name).unlink(missing_ok=True)


def to_json(content: object) -> str:
    """Write strict JSON: NumPy values as Python values, NaN and infinity as null."""
    return json.dumps(plain(content, lambda _: None), indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def plain(content: object, convert: Callable[[float], Any]) -> Any:
    """Convert content to types that JSON has, and each NaN and infinity by the function `convert`."""
    if isinstance(content, np.ndarray | np.generic):
        content = content.tolist()
    if isinstance(content, Mapping):
        return {str(key): plain(value, convert) for key, value in content.items()}
    if isinstance(content, list | tuple | set):
        return [plain(value, convert) for value in content]
    if isinstance(content, float) and not math.isfinite(content):
        return convert(content)
    return content if isinstance(content, str | int | float | None) else str(content)


class Progress:
    """Display of the progress of a long run on stderr; a study's `run` gets it as `progress`."""

    def __init__(self, quiet: bool = False, cases_a_process: float = 1.0) -> None:
        self.quiet, self.cases_a_process = quiet, cases_a_process  # cases a worker process runs: above 1 only in a sweep

    def __call__(self, items: Iterable[T], total: int | None = None, label: str = "") -> Iterator[T]:
        """Yield the items, and show a bar with their number after some time."""
        if self.quiet:
            yield from items
            return
        from tqdm import tqdm

        delay = 0.5 if sys.stderr.isatty() else 20.0  # [s]; in a file each refresh is a line, so that short runs write none
        yield from tqdm(items, label or None, total, leave=False, mininterval=delay / 5, delay=delay)

    def forecast(self, title: str) -> Forecast | bool:
        """Return the display for one `simulate`: a bar, and in a sweep a forecast, its run time times the cases a process."""
        is_shown = self.cases_a_process > 1 or not self.quiet  # a long sweep is forecast even without a bar
        return Forecast(title, self.cases_a_process, bar=not self.quiet) if is_shown else False


QUIET = Progress(quiet=True)
"""Progress that shows nothing."""
