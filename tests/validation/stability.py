"""Classic problems of stability and frequency: statics against closed forms, shooting, or published numbers.

Closed forms and shooting are of the same theory, Reissner's strip with shear and stretching; docs/theory-stability.md has the
sources. Published numbers are rounded, or of a simpler theory: the error that statics reports need not cover the difference.
Columns are along x, of length L and bending stiffness EI; loads are in the unit that each function names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from math import nan, pi
from typing import Any

import numpy as np
from exact import columns, frames
from exact.columns import LENGTH, STRIP, THIN, ZIEGLER
from exact.frames import Frame
from exact.vibration import beam_frequencies
from scipy.optimize import brentq

from buckler import mbs
from buckler.mbs import frequencies, path
from buckler.mbs.statics.answer import Path
from buckler.studies.kit.published import GRAVITY

from .known import Answer, Known, relate

FLUTTER, SHARP, FRAME = 1e-4, 1e-8, 1e-5
"""Relative errors allowed of flutter, of closed forms, of frames."""


def pick(found: Path, kind: str, exact: float, allowed: float, number: int = 0, unit: str = "1") -> Answer:
    """Compare an entry of a path's `limits`, `branchings` or `flutter` with the exact load."""
    return relate(getattr(found, kind)[number], exact, allowed, unit, reported=float(found.errors[kind][number]))


def publish(answer: Answer) -> Answer:
    """Drop the reported error of an answer that is compared with a published number."""
    return answer._replace(reported=nan)


def solve_euler(ends: str, number: int) -> Answer:
    """Find a buckling load of a column with these ends [N]."""
    exact = columns.critical(ends, number)
    return pick(path(columns.column(ends), to=1.1 * exact), "branchings", exact, SHARP, number - 1, "N")


def solve_thin(exact: float, **options: Any) -> Answer:
    """Find the load of flutter of a thin cantilever, over EI/L^2."""
    loaded = columns.column("cantilever", THIN, THIN.bending_stiffness / LENGTH**2, **options)
    return publish(pick(path(loaded, to=25.0), "flutter", exact, FLUTTER))


def solve_pfluger(ratio: float) -> Answer:
    """Find the same of Beck's column with a mass at its tip (A. Pflüger, Z. angew. Math. Mech. 35 (1955) 191)."""
    return solve_thin(columns.flutter_with_tip(ratio), follows="strip", tip=ratio * THIN.mass_per_length * LENGTH)


def solve_leipholz() -> Answer:
    """Find the load of flutter under a tangential force along the column, over EI/L^3.

    H. H. E. Leipholz, Z. angew. Math. Phys. 13 (1962) 581: 40.05.
    """
    unit = THIN.bending_stiffness / LENGTH**3
    loaded = replace(columns.column("cantilever", THIN, 0.0), loads=[mbs.LineLoad("strip", (-unit, 0.0), turns=True)])
    return publish(pick(path(loaded, to=45.0), "flutter", columns.leipholz(14), FLUTTER))


def solve_ziegler(damping: float) -> Answer:
    """Find the load of flutter of Ziegler's pendulum over k/l, with damping b over sqrt(m k) l in both joints.

    Exact are 7/2 - sqrt 2 without damping, 41/28 + b^2/(2 m k l^2) with small damping.
    """
    length, stiffness, mass = ZIEGLER
    damper = damping * float(np.sqrt(mass * stiffness)) * length
    exact = 41 / 28 + damping**2 / 2 if damping else 3.5 - np.sqrt(2.0)
    return pick(path(columns.ziegler(damper, damper), load="force.B", to=2.5), "flutter", exact, FLUTTER)


def solve_portal() -> Answer:
    """Find the load at which a portal frame sways, over EI/L^2: it is (kL)^2 with kL tan kL = 6 (Timoshenko and Gere 1961).

    Three equal members stand on two hinges and are pressed at both corners.
    """
    names, points = ("left", "beam", "right"), {"A": (0, 0), "B": (0, LENGTH), "C": (LENGTH, LENGTH), "D": (LENGTH, 0)}
    members = [mbs.Link(name, ends[0], ends[1], mbs.Beam(STRIP)) for name, ends in zip(names, ("AB", "BC", "DC"), strict=True)]
    welds = [mbs.Weld("B", "left", "beam"), mbs.Weld("C", "beam", "right")]
    joints = [*welds, mbs.Revolute("A", "ground", "left"), mbs.Revolute("D", "ground", "right")]
    unit = STRIP.bending_stiffness / LENGTH**2
    found = path(mbs.Mechanism(points, members, joints, loads=[mbs.Force(p, (0, -unit)) for p in "BC"]), to=1.9)
    wave = brentq(lambda x: x * np.sin(x) - 6 * np.cos(x), 1.0, 1.5, xtol=1e-14)
    return publish(pick(found, "branchings", wave**2, FLUTTER))


def solve_truss() -> Answer:
    """Find the limit load of a mass on two inclined springs [N]: F = 2 k (l0 - l) y/l is largest where l^3 = l0."""
    height, stiffness = 0.3, 1e4
    free = float(np.hypot(1, height))
    made = mbs.Mechanism(
        points={"P": (0, height), "Q": (0, height + 0.1), "A": (-1, 0), "C": (1, 0)},
        links=[mbs.Link("block", "P", "Q", mbs.Rigid.of(mass=1.0, inertia=1e-3))],
        joints=[mbs.Slider("P", "block", "ground", along=(0, 1))],
        loads=[
            *(mbs.Spring("P", f"ground:{end}", stiffness=stiffness, free_length=free) for end in "AC"),
            mbs.Force("P", (0, -1.0)),
        ],
    )
    y = float(np.sqrt(free ** (2 / 3) - 1))
    exact = 2 * stiffness * (free - np.hypot(1, y)) * y / np.hypot(1, y)
    return pick(path(made, load="force.P", to=2 * exact), "limits", exact, SHARP, unit="N")


FRAMES: dict[str, Callable[[], Frame]] = {
    "toggle": frames.toggle,
    "lee": frames.lee,
    "roorda": partial(frames.roorda, -0.01),
    "deep_arch": frames.deep_arch,
    "cosine_arch": frames.cosine_arch,
}
CROSSED = {"toggle": (2, 0), "lee": (2, 0), "roorda": (2, 0), "deep_arch": (2, 0), "cosine_arch": (2, 6)}
"""Numbers of limits and of branchings of each path."""


@cache
def follow(name: str) -> tuple[Path, dict[str, list[float]]]:
    """Return the path of a frame, and its critical loads by shooting, by kind."""
    frame = FRAMES[name]()
    exact: dict[str, list[float]] = {"limit": [], "branching": []}
    for kind, load in frame.chain.critical():
        exact[kind].append(load)
    return path(frame.mechanism, to=frame.chain.to), exact


def solve_frame(name: str, kind: str, number: int) -> Answer:
    """Find a limit or a branching of a frame's path."""
    found, exact = follow(name)
    return pick(found, {"limit": "limits", "branching": "branchings"}[kind], exact[kind][number], FRAME, number)


def solve_frequency(ends: str, number: int, section: mbs.Section) -> Answer:
    """Find a natural frequency of a beam [Hz]."""
    joints = {"cantilever": [mbs.Weld("A", "ground", "s")], "clamped-clamped": [mbs.Weld(p, "ground", "s") for p in "AB"]}[ends]
    made = mbs.Mechanism({"A": (0, 0), "B": (LENGTH, 0)}, [mbs.Link("s", "A", "B", mbs.Beam(section))], joints)
    found = frequencies(made, count=number)
    exact = float(beam_frequencies(columns.member(section), ends, number)[number - 1]) / (2 * pi)
    return relate(found.hertz[number - 1], exact, 1e-7, "Hz", reported=float(found.errors[number - 1]))


def solve_near_buckling() -> Answer:
    """Find the lowest frequency of a pinned column at 0.99 of its buckling load P [Hz].

    Reissner's strip, shortened by 1 - s = P/EA, has the deflection sin kx and the turn cos kx with k = pi/L. At the angular
    frequency w this matrix is singular: [GA k^2, -(GA s + P) k; sym., EI k^2 + GA s^2 + P s] - w^2 diag(rho A, rho I).
    """
    load, wave = 0.99 * columns.critical("pinned", 1), pi / LENGTH
    found = frequencies(columns.column("pinned", load=load), count=1)
    shear, short = STRIP.shear_stiffness, 1 - load / STRIP.axial_stiffness
    across, turn = shear * wave**2, STRIP.bending_stiffness * wave**2 + shear * short**2 + load * short
    mass, inertia = STRIP.mass_per_length, STRIP.inertia_per_length
    linear = across * inertia + turn * mass  # w^4 mass inertia - w^2 linear + determinant = 0
    determinant = wave**2 * shear * (STRIP.bending_stiffness * wave**2 - load * (short + load / shear))
    square = 2 * determinant / (linear + np.sqrt(linear**2 - 4 * determinant * mass * inertia))
    return relate(found.hertz[0], np.sqrt(square) / (2 * pi), 1e-6, "Hz", reported=float(found.errors[0]))


def solve_pendulum(turn: float) -> Answer:
    """Find the equilibrium of a pendulum, drawn at an angle [rad]: its tip is 1 m below the joint."""
    made = mbs.Mechanism(
        {"O": (0, 0), "A": (float(np.cos(turn)), float(np.sin(turn)))}, [mbs.Link("bar", "O", "A", mbs.Rigid(STRIP))],
        [mbs.Revolute("O", "ground", "bar")], gravity=(0, -GRAVITY),
    )  # fmt: skip
    rest = mbs.equilibrium(made)
    return relate(rest.point("bar", "A").position[1], -1.0, SHARP, "m", reported=rest.error)


def list_known() -> Iterator[Known]:
    """Yield the problems of stability and frequency."""
    case = partial(Known, "stability")
    flutter = "columns that flutter: Beck, Reut (load 20.05 EI/L^2), Leipholz, Pflüger"
    yield case(flutter, "beck", partial(solve_thin, 20.05095, follows="strip"))
    yield case(flutter, "reut", partial(solve_thin, 20.05095, through=(0.0, 0.0)))  # line of action fixed
    yield case(flutter, "leipholz", solve_leipholz)
    for ratio in (0.1, 1.0):
        yield case(flutter, f"pflüger {ratio:g}", partial(solve_pfluger, ratio))
    for damping in (0.0, 0.01):
        yield case("Ziegler's pendulum, undamped and damped", f"ziegler {damping:g}", partial(solve_ziegler, damping))
    for ends in ("pinned", "cantilever", "propped", "clamped", "swaying", "turning"):
        for n in range(1, 6):
            yield case("Euler's columns, six pairs of ends, five loads each", f"{ends} {n}", partial(solve_euler, ends, n), n > 2)
    yield case("portal frame that sways", "portal", solve_portal)
    yield case("truss of two springs that snaps", "truss", solve_truss)
    for name, counts in CROSSED.items():
        for kind, count in zip(("limit", "branching"), counts, strict=True):
            for k in range(count):
                solve = partial(solve_frame, name, kind, k)
                yield case("frames and arches that snap, against shooting", f"{name} {kind} {k + 1}", solve, slow=True)
    for number, ends in ((12, "cantilever"), (6, "clamped-clamped")):
        yield case("frequencies of beams", f"{ends} {number}", partial(solve_frequency, ends, number, STRIP))
    yield case("frequency of a column at 0.99 of its load", "near buckling", solve_near_buckling)
    for turn in (-2.9, -0.4, 0.3, 1.5, 2.2):
        yield case("rest of a pendulum, from five angles", f"{turn:g} rad", partial(solve_pendulum, turn))
