"""Which studies there are. A static table, so that listing them imports none of them."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import NamedTuple


class Entry(NamedTuple):
    """Where a study lives and what it is about."""

    module: str
    summary: str


STUDIES: dict[str, Entry] = {
    "elastica-law": Entry(
        "buckler.studies.strips.elastica_law", "load of the pinned strip against shortening: exact, quartic, fast law"
    ),
    "contact-force-table": Entry(
        "buckler.studies.strips.contact_force_table", "largest contact force for three strip thicknesses"
    ),
    "slider-crank": Entry("buckler.studies.striking.slider_crank", "flexible slider-crank striking its stop at constant speed"),
    "slider-crank-ramp": Entry("buckler.studies.striking.slider_crank_ramp", "the same, the crank speed rising over the run"),
    "slider-crank-voltage": Entry(
        "buckler.studies.striking.slider_crank_voltage", "the same, its crank turned by a motor at given voltage"
    ),
    "paper-figures": Entry(
        "buckler.studies.striking.paper_figures", "Figs 5, 6, 10, 11 of the slider-crank paper on their own axes"
    ),
    "identify": Entry(
        "buckler.studies.striking.identify", "which cause explains the measured impact forces, and what would tell causes apart"
    ),
    "strike": Entry("buckler.studies.striking.strike", "one strike of the slider-crank: force, pulse, torque, rebound"),
    "impact-map": Entry(
        "buckler.studies.striking.impact_map", "strikes of a beam over speed, bow, stop and mass: regimes and their borders"
    ),
    "thickness-speed": Entry("buckler.studies.striking.thickness_speed", "the slider-crank over strip thickness and crank speed"),
    "design": Entry(
        "buckler.studies.striking.design", "the slider-crank designed backwards: wanted forces in, strip, stop and speed out"
    ),
    "static-precision": Entry(
        "buckler.studies.strips.static_precision", "load of a buckled strip: error against run time of each model"
    ),
    "dynamic-buckling": Entry(
        "buckler.studies.strips.dynamic_buckling", "strip compressed at constant speed: peak force over speed and bow"
    ),
    "benchmarks": Entry("buckler.studies.trust.benchmarks", "published benchmark problems: reference, result, error, run time"),
    "experiments": Entry(
        "buckler.studies.measured.experiments", "measured pendulums: fitted to a part of the data, the rest predicted"
    ),
    "stability": Entry("buckler.studies.trust.stability", "classic problems of stability: found, exact, error told"),
    "lean-scenes": Entry("buckler.studies.trust.lean_scenes", "what each scene is made of, and what each optional part costs"),
    "extremes": Entry(
        "buckler.studies.trust.extremes", "extreme cases, listed and drawn: is any run reported fine that is wrong?"
    ),
    "benchmark": Entry(
        "buckler.studies.trust.benchmark", "each kind of job once, ours against a plain baseline: errors, medians, ratios"
    ),
    "accuracy": Entry(
        "buckler.studies.trust.accuracy", "accuracy asked for against accuracy delivered, random mechanisms of every kind"
    ),
    "two-solvers": Entry(
        "buckler.studies.trust.two_solvers", "two solvers that share no equation: difference against estimates, run times"
    ),
    "solver-speed": Entry(
        "buckler.studies.trust.solver_speed", "the compiled solver beside hand-tuned plain runs of the engine: errors, run times"
    ),
    "scaling": Entry(
        "buckler.studies.trust.scaling", "how the cost of a step grows with the mechanism: chains, a net, rattling joints"
    ),
    "smooth-precision": Entry(
        "buckler.studies.trust.smooth_precision", "slider-crank without a stop: error against run time, against a spectral strip"
    ),
    "slider-crank-precision": Entry(
        "buckler.studies.striking.slider_crank_precision",
        "flexible slider-crank: error against run time of each model and tolerance",
    ),
    "restitution": Entry(
        "buckler.studies.trust.restitution", "restitution asked for and delivered: every contact law in drop tests"
    ),
    "crank-rocker": Entry(
        "buckler.studies.rattling.crank_rocker", "crank-rocker with clearance in its joints, rocker rigid or flexible"
    ),
    "clearance-precision": Entry(
        "buckler.studies.rattling.clearance_precision",
        "crank-rocker with clearance: error against run time of rigid, beam and modal rocker",
    ),
    "nonsmooth": Entry(
        "buckler.studies.rattling.nonsmooth", "smooth contact laws against published trajectories of nonsmooth dynamics"
    ),
    "clearance-speed": Entry(
        "buckler.studies.rattling.clearance_speed", "crank-rocker with clearance joints, over gap and speed: forces, penetration"
    ),
    "bifurcation": Entry(
        "buckler.studies.rattling.bifurcation", "crank-rocker with clearance: order or chaos over clearance, speed, damping"
    ),
    "uncertainty": Entry("buckler.studies.striking.uncertainty", "tolerances: distributions of forces and whose variance it is"),
    "wear": Entry(
        "buckler.studies.rattling.wear", "where the crank-rocker's joints wear over a million turns, rocker rigid or flexible"
    ),
    "buffering-claims": Entry(
        "buckler.studies.rattling.buffering_claims", "does a flexible rocker buffer? each published claim, over many runs"
    ),
    "buffering-world": Entry(
        "buckler.studies.rattling.world", "the same in one world: everything that the paper leaves open has one value"
    ),
    "gravity-flip": Entry(
        "buckler.studies.rattling.gravity_flip", "does gravity flip the buffering? over theory, number and frequency of the modes"
    ),
    "modes": Entry("buckler.studies.rattling.modes", "which modes of the rocker matter, and what their numbers mean"),
}


class UnknownStudyError(ValueError):
    """A study was asked for that the table does not hold."""


GROUP = "buckler.studies"
"""Entry points by which other packages offer studies: `my-study = "my_package.my_study"`."""


def everything() -> dict[str, Entry]:
    """Studies of Buckler and of other packages that are installed."""
    from importlib.metadata import entry_points

    others = {
        point.name: Entry(point.value, f"of {point.dist.name}" if point.dist else "") for point in entry_points(group=GROUP)
    }
    return {**others, **STUDIES}


def entry(name: str) -> Entry:
    """Look a study up.

    Raises
    ------
    UnknownStudyError
        With the closest name, if there is one.
    """
    studies = STUDIES if name in STUDIES else everything()
    if name not in studies:
        here = next(
            (f"did you mean {name}{ending}?" for ending in (".toml", ".json", ".py") if Path(f"{name}{ending}").is_file()), ""
        )
        raise UnknownStudyError(f"unknown study '{name}'; {here or hint(name, studies) or '`buckler list` names them'}")
    return studies[name]


def load(name: str) -> ModuleType:
    """Import a study by its name or file, always under its true module name, so that what it defines can be pickled.

    Raises
    ------
    ValueError
        If there is no such study, or the file defines none.
    """
    if not name.endswith(".py"):
        return importlib.import_module(entry(name).module)
    path = Path(name).resolve()
    if not path.is_file():
        raise UnknownStudyError(f"{name}: no such file")
    if str(path.parent) not in sys.path:
        sys.path.insert(0, str(path.parent))  # worker processes get the same path
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
    """'did you mean ...?' with the closest of the known words, or nothing."""
    import difflib  # rarely needed, and listing studies is quick without it

    close = difflib.get_close_matches(word, list(known), n=1)
    return f"did you mean {close[0]}?" if close else ""
