"""What a study hands back, and how it is printed and filed: metrics with their error, signals, tables, provenance.

`metrics.json` is strict JSON: what is not a finite number is null. Each file is written whole or not at all.
"""

from __future__ import annotations

import json
import math
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import IO, Any, TypeVar

import numpy as np

from .parameters import StudyParameters
from .style import Figure, house_style
from .versions import versions

T = TypeVar("T")
P = TypeVar("P", bound=StudyParameters)


@dataclass(frozen=True)
class Metric:
    """One number a study is about.

    Attributes
    ----------
    value : the number found
    unit : its unit, "1" for a plain number
    published, exact : what was published, and what is known to be right, in the same unit
    error : relative error of the value: against `exact` where that is given and not zero, otherwise the study's own estimate,
        if it has one
    """

    value: float
    unit: str
    published: float | None = None
    exact: float | None = None
    error: float | None = None

    def __post_init__(self) -> None:
        if self.error is None and self.exact:
            object.__setattr__(self, "error", abs(self.value - self.exact) / abs(self.exact))

    def plain(self) -> dict[str, Any]:
        """What is known of it, by name."""
        return {key: value for key, value in asdict(self).items() if value is not None or key == "value"}

    def shown(self, value: str = ".4g", error: str = ".2g") -> str:
        """Value and standard error in these formats: 12.3 ± 0.4; the value alone where no error is known."""
        return f"{self.value:{value}}" + ("" if self.error is None else f" ± {abs(self.value) * self.error:{error}}")


@dataclass(frozen=True)
class Table:
    """Rows under headers, the headers with their units; the notes stand below."""

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
    """What `run` returns.

    Attributes
    ----------
    parameters : what was run
    status : "OK", "SUSPECT" for a run that ended but fails a check of its own, or the name of the failure
    message : a sentence a person can act on; needed unless the status is "OK"
    metrics : dict of Metric
    signals : written to signals.npz; in SI
    units : of signals, where they are known
    work : steps, Jacobians, evaluations; `wall_s` is added if it is not there
    tables : printed instead of the table of metrics
    pages : whole HTML pages by file name
    notes : worth knowing, told after the status
    """

    parameters: StudyParameters
    status: str = "OK"
    message: str = ""
    metrics: Mapping[str, Metric] = field(default_factory=dict)
    signals: Mapping[str, np.ndarray] = field(default_factory=dict)
    work: Mapping[str, Any] = field(default_factory=dict)
    tables: Sequence[Table] = ()
    pages: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    notes: Sequence[str] = ()

    def changed(self, **values: Any) -> StudyResult:
        """The same with other values."""
        return replace(self, **values)

    def of(self, kind: type[P]) -> P:
        """The parameters, which are of a kind."""
        if not isinstance(self.parameters, kind):
            raise TypeError(f"parameters: must be {kind.__module__}.{kind.__name__}")
        return self.parameters

    def __post_init__(self) -> None:
        if self.status != "OK" and not self.message:
            raise ValueError(f"status = {self.status}: a message must say what went wrong")

    def __str__(self) -> str:
        return "\n\n".join(map(str, self.tables or ([metrics_table(self.metrics)] if self.metrics else [])))


def judged(wrong: Sequence[str], message: str = "") -> dict[str, Any]:
    """Status and message of a study: SUSPECT where something is wrong, told in that many sentences."""
    return {"status": "SUSPECT" if wrong else "OK", "message": "; ".join(wrong) or message}


def worst(runs: Iterable[tuple[str, Any]], notes: Iterable[str] = ()) -> dict[str, Any]:
    """Status and message of a study: those of the worst of its runs, each a name and what has both, and all that was noted."""
    wrong = [(name, run) for name, run in runs if run.status != "OK"]
    status = min((run.status for _, run in wrong), key=lambda status: status == "SUSPECT", default="OK")
    return {"status": str(status), "message": "; ".join([*(f"{name}: {run.message}" for name, run in wrong), *notes])}


def metrics_table(metrics: Mapping[str, Metric]) -> Table:
    """One row a metric; columns nobody fills are left out."""
    rows = [(name, *_printed(m), None if m.error is None else relative(m.error)) for name, m in metrics.items()]
    headers = ("metric", "value", "unit", "published", "exact", "relative error")
    kept = [i for i in range(len(headers)) if i < 3 or any(row[i] is not None for row in rows)]
    return Table([headers[i] for i in kept], [[row[i] for i in kept] for row in rows])


def relative(error: float) -> str:
    """A relative error as people read it: per cent, or a power of ten below a thousandth."""
    return f"{error:.1e}" if error < 1e-3 else f"{100 * error:.2g} %" if error < 1 else f"{100 * error:.0f} %"


def _printed(metric: Metric) -> tuple[Any, ...]:
    """Value, unit, published and exact value; a stress in MPa."""
    values = metric.value, metric.published, metric.exact
    if metric.unit != "Pa":
        return values[0], metric.unit, *values[1:]
    mega = [None if value is None else value / 1e6 for value in values]
    return mega[0], "MPa", *mega[1:]


class Progress:
    """Shows how far a run is, on stderr, if it takes long enough to ask; `run` gets one.

    `for case in progress(cases, label="thickness")` is all a study writes.
    """

    def __init__(self, quiet: bool = False) -> None:
        self.quiet = quiet

    def __call__(self, items: Iterable[T], total: int | None = None, label: str = "") -> Iterator[T]:
        """Yield the items, counting them."""
        if self.quiet:
            yield from items
            return
        from tqdm import tqdm

        pace = _pace()
        yield from tqdm(items, desc=label or None, total=total, delay=pace, mininterval=pace / 5, leave=False)

    @contextmanager
    def of_runs(self, label: str) -> Iterator[Callable[[float], None] | None]:
        """Show the fraction done of one run after another: what comes after the end, or is less than before, is of the next."""
        if self.quiet:
            yield None
            return
        from tqdm import tqdm

        pace, runs = _pace(), 1
        form = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}"
        with tqdm(total=1.0, desc=f"{label}, run 1", delay=pace, mininterval=pace / 5, leave=False, bar_format=form) as bar:

            def show(done: float) -> None:
                nonlocal runs
                if done < bar.n or bar.n >= 1.0:
                    runs += 1
                    bar.set_description_str(f"{label}, run {runs}", refresh=False)
                    bar.update(-bar.n)
                bar.update(done - bar.n)

            yield show


@contextmanager
def counting(what: str) -> Iterator[Callable[[], object]]:
    """Show how many there were of what nobody knows the number of, as `Progress` does."""
    from tqdm import tqdm

    pace = _pace()
    with tqdm(unit=f" {what}", delay=pace, mininterval=pace / 5, leave=False) as bar:
        yield bar.update


def _pace() -> float:
    """Seconds of work before anything is shown: a terminal may be redrawn often, a log file gets a line now and then."""
    return 0.5 if sys.stderr.isatty() else 20.0


QUIET = Progress(quiet=True)


def write(result: StudyResult, folder: Path, figures: Mapping[str, Figure], trusted: bool = False) -> str:
    """Write signals.npz, the figures and, last, metrics.json; what an earlier run left there goes first.

    Parameters
    ----------
    trusted : record that whoever ran the study overrode its failed checks; the status stays SUSPECT, with its reasons

    Returns
    -------
    text : the content of metrics.json
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
    """Remove what the metrics.json in this folder lists, so that no old figure stands beside new numbers."""
    try:
        listed = json.loads((folder / "metrics.json").read_text())["files"]
    except (OSError, ValueError, LookupError, TypeError):
        return
    for name in [*listed, "metrics.json"]:
        if Path(name).name == name:
            (folder / name).unlink(missing_ok=True)


def to_json(content: object) -> str:
    """Write strict JSON: numpy values as plain ones, NaN and infinity as null."""
    return json.dumps(plain(content, lambda _: None), indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def plain(content: object, beyond: Callable[[float], Any]) -> Any:
    """Content as JSON can hold it: numpy values as plain ones, `beyond` of each float that is not finite."""
    if isinstance(content, np.ndarray | np.generic):
        content = content.tolist()
    if isinstance(content, Mapping):
        return {str(key): plain(value, beyond) for key, value in content.items()}
    if isinstance(content, list | tuple | set):
        return [plain(value, beyond) for value in content]
    if isinstance(content, float) and not math.isfinite(content):
        return beyond(content)
    return content if isinstance(content, str | int | float | None) else str(content)


def provenance(parameters: StudyParameters) -> dict[str, Any]:
    """What it takes to run the same again: versions, commit, machine, parameters."""
    return {
        "versions": versions(),
        "commit": _commit(),
        "machine": {"cpu": _cpu(), "cores": os.cpu_count(), "os": platform.platform()},
        "parameters": parameters.plain(),
    }


def _commit() -> str | None:
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():  # installed, perhaps inside somebody else's repository
        return None
    command = ["git", "-C", str(root), "describe", "--always", "--tags", "--dirty=+dirty"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return None


def _cpu() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())
