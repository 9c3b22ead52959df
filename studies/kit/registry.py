"""Table of the studies, and their import by name or file. The table is static: listing the studies imports none of them."""

import importlib
import sys
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import NamedTuple


class StudyEntry(NamedTuple):
    """Module of a study, and its subject in one line."""

    module: str
    summary: str


STUDIES: dict[str, StudyEntry] = {
    name: StudyEntry(f"buckler.studies.{package}.{name.replace('-', '_')}", summary)
    for package, name, summary in (
        ("strips", "elastica-law", "load of the pinned strip against shortening: exact, quartic, fast law"),
        ("strips", "contact-force-table", "largest contact force for three strip thicknesses, with and without dry friction"),
        ("striking", "slider-crank", "flexible slider-crank striking its stop: constant speed, rising speed, voltages"),
        ("striking", "paper-figures", "Figs 5, 6, 10, 11 of the slider-crank paper on their own axes"),
        ("striking", "impact-map", "strikes of a beam over speed, bow, stop and mass: regimes and their borders"),
        ("striking", "thickness-speed", "the slider-crank over strip thickness and crank speed"),
        ("striking", "design", "slider-crank designed backwards: forces and angle in, strip, stop and speed out"),
        ("error_against_run_time", "error-against-run-time", "error against run time of hand-tuned and automatic runs"),
        ("strips", "dynamic-buckling", "strip compressed at constant speed: peak force over speed and bow"),
        ("extremes", "extremes", "extreme and random mechanisms: is any run reported fine that is wrong?"),
        ("rattling", "crank-rocker", "crank-rocker with clearance in its joints, rocker rigid or flexible"),
        ("rattling", "clearance-speed", "crank-rocker with clearance joints, over gap and speed: forces, penetration"),
        ("rattling", "buffering", "does a flexible rocker buffer? each published claim, over all that is left open"),
        ("rattling", "modes", "which modes of the rocker matter, and what their numbers mean"),
    )
}
"""Studies of Buckler, by name, in the order in which they are listed."""


def find_studies() -> dict[str, StudyEntry]:
    """Find the studies of Buckler, and those that other packages declare as entry points of the group `buckler.studies`."""
    from importlib.metadata import entry_points

    points = entry_points(group="buckler.studies")
    return {point.name: StudyEntry(point.value, f"of {point.dist.name}" if point.dist else "") for point in points} | STUDIES


def entry(name: str) -> StudyEntry:
    """Look up a study by its name; a ValueError for an unknown name suggests the closest known one."""
    studies = STUDIES if name in STUDIES else find_studies()
    if name not in studies:
        # Names that end in .toml, .json or .py do not come here: `running.find_study` and `load` open these files.
        if "." in name or Path(name).exists():
            raise ValueError(f"{name}: neither a file of a mechanism (.toml, .json) nor of a study (.py)")
        files = [f"{name}{suffix}" for suffix in (".toml", ".json", ".py") if Path(f"{name}{suffix}").is_file()]
        likely = f"did you mean {files[0]}?" if files else hint(name, studies)
        raise ValueError(f"unknown study '{name}'; {likely or '`buckler list` names them'}")
    return studies[name]


def load(name: str) -> ModuleType:
    """Import a study by its name or file; a file is imported as a module, so that the study's classes can be pickled."""
    if not name.endswith(".py"):
        return importlib.import_module(entry(name).module)
    path = Path(name).resolve()
    if not path.is_file():
        raise ValueError(f"{name}: no such file")
    if str(path.parent) not in sys.path:
        sys.path.insert(0, str(path.parent))  # worker processes inherit it, and find the module as well
    try:
        study = importlib.import_module(path.stem)
    except SyntaxError as error:
        raise ValueError(f"{name}: line {error.lineno}: {error.msg}") from None
    if Path(study.__file__ or "").resolve() != path:
        raise ValueError(f"{name}: another module is called {path.stem}; rename the file")
    for part in ("Parameters", "run", "figure"):
        if not hasattr(study, part):
            raise ValueError(f"{name}: no study, it defines no `{part}`; see docs/how-to-add-a-study.md")
    return study


def hint(word: str, known: Iterable[str]) -> str:
    """Return 'did you mean ...?' with the known word closest to a word, or an empty text."""
    import difflib  # rarely needed, and slow to load

    close = difflib.get_close_matches(word, list(known), n=1)
    return f"did you mean {close[0]}?" if close else ""
