"""Load of the pinned strip over its end shortening: closed form, rod, published quartic, rational fit (`law.fast`).

The study draws Fig. 3 of the paper, and the error of each law against the closed form by elliptic integrals. The rod solves the
boundary value problem of the same strip: `rod`, without extension, must agree to rounding; `strip`, a rod with the strip's axial
and shear stiffness, shows what the closed form neglects. Source: B. Demirel et al., doi 10.1115/IMECE2008-68796.
"""

from dataclasses import dataclass, replace

import numpy as np

from buckler.elastica import law, pinned
from buckler.elastica.rod import Rod
from buckler.mbs.elements.section import Section
from buckler.mbs.library import PAPER

from ..kit.parameters import StudyParameters, integer, quantity
from ..kit.published import STRIP_WIDTH
from ..kit.report import QUIET, Metric, Progress, StudyResult, metrics_table, status_of
from ..kit.style import Figure, subplots


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    thickness: float = quantity(3e-4, "m", 5e-5, 5e-3, "thickness of the strip, for the extensible rod", "strip")
    points: int = integer(201, 11, 10_001, "shortenings between 0 and 1", "numerics")


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Compute the laws on 0 <= u <= 1 and compare them with the closed form."""
    u = np.linspace(0.0, 1.0, p.points)
    exact = pinned.load(u)
    strip = Section(STRIP_WIDTH, p.thickness)
    unit = strip.bending_stiffness / PAPER.coupler**2  # of forces [N]: E I/L^2 of a strip as long as the paper's coupler
    rods = {"rod": Rod(), "strip": Rod(axial=strip.axial_stiffness / unit, shear=strip.shear_stiffness / unit)}
    loads = {"quartic": law.quartic(u), "fast": law.fast(u)}
    loads |= {name: np.array([_at(rod, x) for x in progress(u, label=name)]) for name, rod in rods.items()}
    errors = {name: load / exact - 1 for name, load in loads.items()}
    largest = {name: float(np.abs(error).max()) for name, error in errors.items()}
    # `law.quartic` has the published coefficients, so it agrees with `published`; its error is that against `exact`
    metrics = {
        "euler_load": Metric(float(law.quartic(0.0)), "1", published=law.QUARTIC[-1], exact=pinned.LOAD_CRITICAL),
        "load_at_1": Metric(float(law.quartic(1.0)), "1", published=sum(law.QUARTIC), exact=float(pinned.load(1.0))),
        "quartic_error": Metric(largest["quartic"], "1"),
        "quartic_error_at": Metric(float(u[np.abs(errors["quartic"]).argmax()]), "1"),
        "rod_difference": Metric(largest["rod"], "1"),
        "strip_difference": Metric(largest["strip"], "1"),
        "fast_error": Metric(largest["fast"], "1"),
    }
    # The rod without extension usually differs by rounding, 2e-15; its limit is chosen. That of the fast law is its error bound.
    wrong = [name for name, limit in (("rod", 1e-10), ("fast", 1e-12)) if not largest[name] <= limit]
    notes = (
        "p = P L^2/(E I) over u = end shortening over length; errors relative to the closed form, 0 <= u <= 1.\nrod: boundary "
        f"value problem; strip: extension and shear at {1e3 * p.thickness:g} mm."
    )
    table = replace(metrics_table(metrics), title="Load of the pinned strip", notes=notes)
    checks = status_of([f"{' and '.join(wrong)} off the closed form"] if wrong else [])
    signals = {"shortening": u, "exact": exact, **loads}
    signals |= {f"{name}.error": error for name, error in errors.items()}
    return StudyResult(parameters=p, metrics=metrics, signals=signals, tables=[table], **checks)


def _at(rod: Rod, shortening: float) -> float:
    """Compute the load of a rod; before it buckles, return the critical load, with which the closed form begins."""
    buckling_shortening = rod.critical_load / rod.axial  # 0 for an inextensible rod, whose axial stiffness is infinite
    return rod.at_shortening(shortening).load if shortening > buckling_shortening else rod.critical_load


def figure(result: StudyResult) -> Figure:
    """Draw the load over the shortening, and below it the error of each law."""
    s, u = result.signals, result.signals["shortening"]
    fig, (above, below) = subplots(2, 1, height=130, sharex=True, height_ratios=(1, 1.2))  # height [mm]
    above.plot(u, s["exact"], color="C0", label="exact")
    above.plot(u, s["quartic"], ":", color="C1", linewidth=2, label="published quartic")
    above.set(ylabel="load $P L^2/(E I)$", ylim=(0, None))
    above.legend(loc="lower right")
    styles = {"quartic": ("C1", "published quartic"), "strip": ("C2", "rod: extension and shear")}
    styles |= {"rod": ("C5", "rod: inextensible"), "fast": ("C4", "fast law")}
    for name, (colour, label) in styles.items():
        below.semilogy(u, np.maximum(np.abs(s[f"{name}.error"]), 1e-16), color=colour, label=label)
    below.set(xlabel="end shortening $u = U/L$", ylabel="relative difference from exact", ylim=(1e-16, 2), xlim=(0, 1))
    below.legend(loc="center", bbox_to_anchor=(0.5, 0.45), ncols=2)
    return fig
