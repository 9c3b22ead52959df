"""Extreme and random mechanisms: is any wrong run reported as right, or any right run as suspect?

The mechanisms are drawn by `kit.drawn`, and here from wide ranges, which are a free choice. Numbers are in SI units.

The reference of each run is a closed form, or two runs of the compiled solver that agree. A run is silent if its status is OK
though its error is too large; no run should be. The price of a run is its time over that of one run of the compiled solver.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import pi, sqrt

import numpy as np

from buckler import mbs
from buckler.mbs import laws
from buckler.mbs.library import PAPER, RATTLING, CrankRocker, crank_rocker, slider_crank

from ..kit import drawn
from ..kit.drawn_linkages import Dice, Run, predictable_time
from ..kit.parameters import StudyParameters, choices, integer, quantity
from ..kit.published import STEEL, STRIP_WIDTH
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, status_of
from ..kit.style import COLOURS, Figure, subplots
from .case import Finding, Verdict, judge

BARS = mbs.Section(0.005, 0.020, STEEL)
"""Section of the bars of linkages with clearance."""


def strike(dice: Dice) -> Run:
    """Draw a slider-crank on its stop from wide ranges of thickness, speed, stiffness, restitution, friction and damping."""
    section = mbs.Section(STRIP_WIDTH, dice.log(5e-5, 1e-3)).damped(ratio=dice.log(2e-3, 0.5), length=PAPER.coupler)
    body = dice.one(mbs.Strut(section), mbs.Beam(section, elements=8), mbs.Cable(section, elements=12))
    speed, law = dice.log(0.1, 60), laws.CarvalhoMartins(dice.log(1e3, 1e8), dice.uniform(0.1, 1.0), exponent=1.0)
    mass, last_angle = 0.3, 1.12 * pi  # [kg]; crank angle at the end, past the dead centre at pi, where the slider is on its stop
    friction = mbs.GuideFriction(dice.uniform(0, 0.9) * mass * 9.81)
    return slider_crank(body, law=law, mass=mass, speed=speed, friction=friction), last_angle / speed


def pass_dead_centre(dice: Dice) -> Run:
    """Draw a four-bar near a change point: with a frame 1e-9 to 1e-2 m shorter all bars could lie in one line."""
    paper, speed = CrankRocker(), dice.log(1e-2, 1e5)
    lengths = paper._replace(frame=paper.crank + paper.coupler - paper.rocker + dice.log(1e-9, 1e-2))
    start = dice.one(0.5, -0.3)  # crank angle after or before the change point, which is at 0; the sizes are a free choice
    return crank_rocker(mbs.Rigid(BARS), speed=speed, section=BARS, lengths=lengths, angle=start), 2 * pi / speed


def rattle(dice: Dice) -> Run:
    """Draw a crank-rocker with clearance from wide ranges of gap, stiffness, friction and speed."""
    gap, factor, speed = dice.log(1e-6, 2e-3), dice.log(1e-2, 1e2), dice.log(0.1, 500)
    damping = RATTLING.damping * sqrt(factor)  # as critical damping, which grows with the root of the stiffness
    law = laws.Impact(RATTLING.stiffness * factor, damping=damping, damping_depth=1e-5)  # [m], as in `RATTLING`
    coulomb = laws.Coulomb(dice.uniform(0, 0.9), dice.log(1e-4, 1e-2))
    friction = dice.one(laws.NoFriction(), coulomb, laws.AdamsFriction(static=0.9, dynamic=0.1, v_s=1e-3, v_d=1e-2))

    joints = dice.one("B", "BC", "ABC", "OABC")
    play = partial(mbs.Clearance, pin=5e-3, gap=gap, law=law, friction=friction)
    linkage = crank_rocker(mbs.Rigid(BARS), speed=speed, play=play, with_play=joints, section=BARS, angle=0.5)
    return linkage, predictable_time(speed)


FAMILIES = {**drawn.FAMILIES, "strike range": strike, "dead centre": pass_dead_centre, "clearance range": rattle}
"""Generators of mechanisms by family."""
SLUGS = {name.replace(" ", "-"): name for name in FAMILIES}
"""Families by their names on the command line."""


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    cases: int = integer(100, 1, 10**6, "number of cases, drawn from the families in turn", "cases")
    seed: int = integer(1, 0, 2**31 - 1, "seed of the random mechanisms", "cases")
    families: tuple[str, ...] = choices(tuple(SLUGS), list(SLUGS), "families of cases", "cases")
    timeout: float = quantity(60.0, "s", 0.1, 3600, "longest time of a run", "cases")


def make_case(p: Parameters, k: int) -> tuple[str, drawn.Draw, float | None]:
    """Draw the k-th case: family, mechanism and accuracy."""
    number, index = divmod(k, len(p.families))
    family = SLUGS[p.families[index]]
    accuracies = (None, None, None, 1e-2, 1e-3)  # three fifths of the cases run without an accuracy
    accuracy = accuracies[int(np.random.default_rng([p.seed, k]).integers(len(accuracies)))]
    return family, drawn.draw(p.seed, number, (family,), FAMILIES), accuracy


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run every case and compare it with its reference."""
    found = [judge(*make_case(p, k), p.timeout) for k in progress(range(p.cases), label="cases")]
    count, right = Counter(f.verdict for f in found), [f.error for f in found if f.verdict is Verdict.RIGHT]
    metrics = {
        "cases": Metric(len(found), "1"),
        **{verdict.replace(" ", "_"): Metric(count[verdict], "1") for verdict in Verdict},
        "price": Metric(float(np.nanmedian([f.price for f in found])), "1"),
        "largest_error_of_right": Metric(max(right, default=0.0), "1"),
    }
    silent = [f"{f.name}: {f.worst} {f.error:.2g} times what is allowed, silent" for f in found if f.verdict is Verdict.SILENT]
    return StudyResult(
        parameters=p, **status_of(silent, f"{len(found)} cases, none of them silently wrong"), metrics=metrics,
        signals={name: np.array([getattr(f, name) for f in found]) for name in Finding._fields},
        tables=[count_families(found), list_exceptions(found)],
    )  # fmt: skip


def count_families(found: Sequence[Finding]) -> Table:
    """Count the verdicts of each family."""
    groups = {name: [f for f in found if f.family == name] for name in FAMILIES} | {"all": list(found)}
    rows = []
    for name, group in groups.items():
        if group:
            right = max((f.error for f in group if f.verdict is Verdict.RIGHT), default=None)
            rows.append([name, len(group), *(sum(f.verdict is v for f in group) for v in Verdict), right])
    return Table(["family", "cases", *Verdict, "largest right error over allowed"], rows, "Extreme and random mechanisms")


def list_exceptions(found: Sequence[Finding]) -> Table:
    """List the cases whose verdict is not RIGHT: largest error over the allowed one, its measure, message of the run."""
    others = sorted((f for f in found if f.verdict is not Verdict.RIGHT), key=lambda f: list(Verdict).index(f.verdict))
    rows = [[f.name, f.verdict, None if np.isnan(f.error) else f"{f.error:.2g} {f.worst}", f.message[:90]] for f in others]
    return Table(["case", "verdict", "error over what is allowed", "message"], rows, "Cases that are not right")


def figure(result: StudyResult) -> Figure:
    """Draw the error of each case, a row for each family; cases without a comparison are at the right end."""
    s, jitter = result.signals, np.random.default_rng(0)
    families = [name for name in FAMILIES if (s["family"] == name).any()]
    fig, ax = subplots(height=60 + 6 * len(families))
    least, most, not_compared = 1e-4, 1e4, 4e5  # errors beyond the ends of the axis are drawn there; all three are chosen
    x = np.where(np.isnan(s["error"]), not_compared, np.clip(s["error"], least, most))
    y = np.array([families.index(name) for name in s["family"]]) + jitter.uniform(-0.3, 0.3, len(x))
    marks = {"right": "o", "named": "P", "false alarm": "D", "silent": "X", "no reference": "*"}
    for (verdict, mark), colour in zip(marks.items(), COLOURS, strict=False):
        part = s["verdict"] == verdict
        ax.plot(x[part], y[part], mark, ms=3.5, color=colour, label=f"{verdict} ({part.sum()})")
    ax.axvline(1.0, color="black", lw=0.8)
    ax.set(xscale="log", xlim=(least / 2, 5 * not_compared), xlabel="error over what is allowed [1]; right: not compared")
    ax.set(yticks=range(len(families)), yticklabels=families, ylim=(len(families) - 0.4, -0.6), ylabel="family")
    ax.legend(loc="lower center", bbox_to_anchor=(0.25, 1.0), ncols=3, columnspacing=1.0)
    return fig
