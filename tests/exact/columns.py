"""Columns under dead and following loads: the mechanisms, and their critical loads in closed form or by other methods.

Exact values are of the same theory (Reissner's strip: shear and stretching); docs/theory-stability.md has sources.
"""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
from scipy.linalg import eigvals
from scipy.optimize import brentq, minimize_scalar

from buckler import mbs

from .member import Member

LENGTH, STRIP, THIN = 0.5, mbs.Section(0.02, 0.001), mbs.Section(0.02, 0.0002)


def column(
    ends: str, section: mbs.Section = STRIP, load: float = 1.0, follows: str | None = None,
    through: tuple[float, float] | None = None, tip: float = 0.0,
) -> mbs.Mechanism:  # fmt: skip
    """A straight strip along x pressed at its far end; ends as in `critical`; one that sways slides on a block."""
    sways = ends in ("swaying", "turning")
    joints: list[Any] = [(mbs.Revolute if ends in ("pinned", "turning") else mbs.Weld)("A", "ground", "strip")]
    joints += [mbs.Slider("B", "strip", "block" if sways else "ground", along=(1, 0))] if ends == "clamped" or sways else []
    joints += [mbs.Slider("B", "block", "ground", along=(0, 1))] if sways else []
    guides = [mbs.Guide("B", "strip")] if ends in ("pinned", "propped") else []
    blocks = [mbs.Link("block", "B", "C", mbs.Rigid.of(mass=1e-3, inertia=1e-6))] if sways else []
    points = {"A": (0.0, 0.0), "B": (LENGTH, 0.0)} | ({"C": (LENGTH, 0.1)} if sways else {})
    return mbs.Mechanism(
        points, [mbs.Link("strip", "A", "B", mbs.Beam(section)), *blocks], joints, guides,
        loads=[mbs.Force("B", (-load, 0), follows=follows, through=through)],
        masses=[mbs.Mass("B", tip)] if tip else [],
    )  # fmt: skip


def critical(ends: str, number: int) -> float:
    """Critical load of Reissner's strip, N: P m = EI k^2 with m = 1 - P/EA + P/GA.

    kL = n pi of pins ('pinned'), and of a clamp and an end that sways and does not turn ('swaying'); (n - 1/2) pi of a cantilever
    and of a pin and such an end ('turning'); tan kL = kL (1 - P/EA)/m with one end clamped, the other pinned ('propped').
    Between clamps ('clamped') kL/2 = n pi and that of kL/2 take turns.
    """
    bend, axial, shear = STRIP.bending_stiffness, STRIP.axial_stiffness, STRIP.shear_stiffness
    parts = 2 if ends == "clamped" else 1
    tangent = ends == "propped" or (ends == "clamped" and number % 2 == 0)
    wave = {"cantilever": number - 0.5, "turning": number - 0.5, "clamped": (number + 1) // 2}.get(ends, number) * pi

    def missing(load: float) -> float:
        softened = 1.0 - load / axial + load / shear
        turn = float(np.sqrt(load * softened / bend)) * LENGTH / parts
        return float(np.sin(turn) - turn * np.cos(turn) * (1.0 - load / axial) / softened) if tangent else turn - wave

    low, high = (wave, wave + pi / 2) if tangent else (0.9 * wave, 1.1 * wave)
    return float(brentq(missing, *(bend * (parts * each / LENGTH) ** 2 for each in (low, high)), xtol=1e-13, rtol=1e-14))


def beck(load: float, square: float, ratio: float = 0.0) -> float:
    """Zero where Beck's column, with so many times its own mass at the tip, swings under a load, EI/L^2, with w^2, EI/(mu L^4).

    y = sum of four exponentials along x; clamped at 0, no moment and, but for the tip's inertia, no transverse force at 1.
    """
    half = np.sqrt(load**2 / 4 + square)
    a, b = np.sqrt(half + load / 2), np.sqrt(half - load / 2)
    c, s, ch, sh = np.cos(a), np.sin(a), np.cosh(b), np.sinh(b)
    # y = A (cos ax - cosh bx) + B (sin ax - a/b sinh bx)
    moment = [-a * a * c - b * b * ch, -a * a * s - a * b * sh]
    shear = [a**3 * s - b**3 * sh, -(a**3) * c - a * b * b * ch]
    place = [c - ch, s - a / b * sh]
    shear = [each + ratio * square * y for each, y in zip(shear, place, strict=True)]
    return float(moment[0] * shear[1] - moment[1] * shear[0])


def flutter_with_tip(ratio: float) -> float:
    """Load, EI/L^2, at which it flutters: there `beck` has two equal roots, its least value between the two first is zero."""

    def least(load: float) -> float:
        sign = np.sign(beck(load, 1e-6, ratio))
        grid = np.linspace(1e-6, 400.0, 801)
        k = int(np.argmin([sign * beck(load, each, ratio) for each in grid]))
        low, high = grid[max(k - 1, 0)], grid[min(k + 1, 800)]
        return float(minimize_scalar(lambda x: sign * beck(load, x, ratio), bounds=(low, high), options={"xatol": 1e-9}).fun)

    return float(brentq(least, 10.0, 24.0, xtol=1e-10))


def leipholz(count: int) -> float:
    """The same by Galerkin's method, EI/L^3: y_xxxx + q (1 - x) y_xx = w^2 y on x^2 times Legendre polynomials.

    Moment and transverse force at the free end vanish by the weak form: a force that turns does no work but q (1 - x) y_xx.
    """
    x, w = np.polynomial.legendre.leggauss(count + 6)
    x, w = 0.5 * (x + 1), 0.5 * w
    legendre = [np.polynomial.Legendre.basis(k, [0, 1]).convert(kind=np.polynomial.Polynomial) for k in range(count)]
    shapes = [np.polynomial.Polynomial([0, 0, 1]) * each for each in legendre]
    y, bend = np.array([each(x) for each in shapes]), np.array([each.deriv(2)(x) for each in shapes])
    mass, stiff, push = (y * w) @ y.T, (bend * w) @ bend.T, (y * w * (1 - x)) @ bend.T

    def swings(load: float) -> float:
        first, second = np.sort_complex(eigvals(stiff + load * push, mass))[:2]
        return float(-(first.imag**2) if first.imag else (first - second).real ** 2)

    return float(brentq(swings, 30.0, 44.0, xtol=1e-9))


ZIEGLER = (0.4, 3.0, 0.7)
"""Length, m, stiffness, N m, and mass, kg, of Ziegler's pendulum."""


def ziegler(first: float, second: float) -> mbs.Mechanism:
    """Two massless bars on torsion springs with dampers, N m s, masses 2 m and m at their ends, a force k/l along the second."""
    length, stiffness, mass = ZIEGLER
    bars = [
        mbs.Link(name, start, end, mbs.Rigid.of(mass=m, inertia=1e-12, centre=(length, 0)))
        for name, start, end, m in (("a", "O", "A", 2 * mass), ("b", "A", "B", mass))
    ]
    return mbs.Mechanism(
        {"O": (0, 0), "A": (length, 0), "B": (2 * length, 0)},
        bars,
        [mbs.Revolute("O", "ground", "a"), mbs.Revolute("A", "a", "b")],
        loads=[
            mbs.TorsionSpring("ground", "a", stiffness=stiffness, damping=first),
            mbs.TorsionSpring("a", "b", stiffness=stiffness, damping=second),
            mbs.Force("B", (-stiffness / length, 0), follows="b"),
        ],
    )  # fmt: skip


def member(section: mbs.Section | mbs.Profile, length: float = LENGTH) -> Member:
    """A strip as a member in closed form."""
    return Member(
        length, section.bending_stiffness, section.mass_per_length, section.shear_stiffness, section.inertia_per_length,
        section.axial_stiffness,
    )  # fmt: skip
