"""Statics on the compiled kernel against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("numba")

from scipy.linalg import expm
from scipy.optimize import brentq

from buckler.elastica import law
from buckler.mbs.elements import Beam, Cable, Drive, Force, Guide, Link, Revolute, Section, Weld
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.statics.follow import path
from buckler.mbs.statics.rest import equilibrium
from buckler.mbs.statics.vibration import frequencies

LENGTH = 0.5


def clamp(point):
    return Weld(point, "ground", "strip")


def strip(body, joints, guides=(), drives=(), loads=()):
    points = {"O": (0.0, 0.0), "A": (LENGTH, 0.0), "M": (LENGTH / 2, 0.0)}
    carries = {} if isinstance(body, Beam | Cable) and not guides else {"M": 0.5}
    link = Link("strip", "O", "A", body, carries)
    return Mechanism(points, [link], joints=joints, guides=guides, drives=drives, loads=loads)


def timoshenko(section, ends, near, shear=True):
    """Frequency near a guess of a strip with ends 'clamped', 'pinned' or 'free', from the exact transfer matrix."""
    ei, ra, ri = section.bending_stiffness, section.mass_per_length, section.inertia_per_length
    ga = section.shear_stiffness if shear else np.inf
    ri = ri if shear else 0.0
    held = {"clamped": (0, 1), "pinned": (0, 2), "free": (2, 3)}

    def mismatch(w):
        # state (w, phi, M, Q)
        a = np.array([[0, 1, 0, 1 / ga], [0, 0, 1 / ei, 0], [0, -ri * w * w, 0, -1], [-ra * w * w, 0, 0, 0]])
        unit = np.array([1, 1 / LENGTH, ei / LENGTH**2, ei / LENGTH**3])
        transfer = expm(a * LENGTH) * unit / unit[:, None]
        free = [i for i in range(4) if i not in held[ends[0]]]
        return np.linalg.det(transfer[np.ix_(held[ends[1]], free)])

    return brentq(mismatch, 0.99 * near, 1.01 * near, xtol=1e-9)


ENDS = {
    "cantilever": ("clamped", "free"),
    "clamped-clamped": ("clamped", "clamped"),
    "clamped-pinned": ("clamped", "pinned"),
    "pinned-pinned": ("pinned", "pinned"),
}


@pytest.mark.parametrize("ends", ENDS.values(), ids=ENDS)
@pytest.mark.parametrize("body", [Beam, Cable])
def test_frequencies_are_timoshenkos(ends, body) -> None:
    section = Section(0.03, 0.02)
    joint = {"clamped": clamp, "pinned": lambda p: Revolute(p, "ground", "strip"), "free": None}
    joints = [joint[end](p) for end, p in zip(ends, "OA", strict=True) if joint[end]]
    found = frequencies(strip(body(section), joints), degree=14, count=3).angular
    for omega in found:
        # axial modes of what is held at both ends lie far above
        assert omega == pytest.approx(timoshenko(section, ends, omega, shear=body is Beam), rel=1e-7)


def test_frequencies_converge_spectrally() -> None:
    section = Section(0.03, 0.02)
    errors = []
    for degree in (4, 6, 8):
        omega = frequencies(strip(Beam(section), [clamp("O")]), degree=degree, count=2).angular[1]
        errors.append(abs(omega / timoshenko(section, ENDS["cantilever"], omega) - 1))
    assert errors[0] > 1e-5
    assert errors[1] < 3e-2 * errors[0]
    assert errors[2] < 3e-2 * errors[1]


@pytest.mark.parametrize("body", [Beam, Cable])
def test_cantilever_elastica(body) -> None:
    """Tip of a cantilever under P L^2/(E I) = 2: deflection 0.49346 L, shortening 0.16064 L (Mattiasson 1981)."""
    section = Section(0.03, 0.0005)
    load = 2 * section.bending_stiffness / LENGTH**2
    rest = equilibrium(strip(body(section), [clamp("O")], loads=[Force("A", (0.0, -load))]), degree=14)
    x, y = rest.point("strip", "A").position / LENGTH
    assert rest.stable
    assert (1 - x, -y) == pytest.approx((0.16064, 0.49346), abs=6e-6)


@pytest.mark.parametrize(("body", "tolerance"), [(Beam, 6e-6), (Cable, 1e-3)])
def test_path_buckles_and_follows_the_elastica(body, tolerance) -> None:
    """Shorten a straight pinned strip: it leaves the straight path at Euler's load and then carries the elastica's."""
    section = Section(0.03, 0.0003)
    made = strip(body(section), [Revolute("O", "ground", "strip")], [Guide("A", "strip")], [Drive("A", 1.0)])
    branch = ("strip", "M", (0.0, 1.0))
    followed = path(made, drive="drive", to=-0.9 * LENGTH, degree=14, branch=branch, step=1e-4, longest=0.05)
    unit = section.bending_stiffness / LENGTH**2
    assert followed.branchings[0] == pytest.approx(-(np.pi**2) * unit / section.axial_stiffness * LENGTH, rel=2e-3)
    u, force = -followed.parameter / LENGTH, followed.reaction("drive")[:, 0] / unit
    bent = u > 1e-3
    assert bent.sum() > 10
    assert np.abs(force[bent] / [law.fast(x) for x in u[bent]] - 1).max() < tolerance
    assert followed.stable[bent].all()
