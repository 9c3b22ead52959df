"""Designs against closed forms and published linkages."""

import numpy as np
import pytest
from scipy.optimize import minimize

from buckler.mbs import Beam, Drive, Force, Guide, Link, Mechanism, Revolute, Rigid, Section, Spring, frequencies, optimise
from buckler.mbs.sensitivity.design import wanted


def block(stiffness=150.0, push=3.0):
    """A block on a guide and a spring, pushed from rest: its largest way is 2 F/k, at the time pi sqrt(m/k)."""
    return Mechanism(
        points={"O": (0.0, 0.0), "A": (0.2, 0.0), "C": (-0.1, 0.0)},
        links=[Link("bar", "O", "A", Rigid.of(mass=1e-9, inertia=1e-12))],
        guides=[Guide("O", "bar", mass=0.5), Guide("A", "bar")],
        loads=[Spring("C", "O", stiffness=stiffness), Force("O", (push, 0.0))],
    )


K, F = "loads[0].stiffness", "loads[1].value[0]"


def test_softest_spring_that_keeps_its_way():
    """The largest push that goes no farther than 30 mm with a spring of at most 180 N/m is k x/2."""
    found = optimise(
        block(), 0.4, free={K: (100.0, 180.0), F: (1.0, 5.0)}, minimise="push",
        subject_to=["max(O.x) <= 30 mm"], readings={"push": lambda m: -m.loads[1].value[0]}, starts=2,
    )  # fmt: skip
    assert found.possible and found.values[F] == pytest.approx(180 * 0.03 / 2, rel=1e-4)
    assert found.binding == [f"{K} = high end", "max(O.x) <= 30 mm"]
    assert abs(found.changes["max(O.x)"]) < 1e-5


def test_values_that_are_asked_for():
    """Two wishes, two numbers: 40 mm after 0.1 s."""
    found = optimise(block(), 0.3, free={K: (100.0, 900.0), F: (1.0, 20.0)},
                     subject_to=["max(O.x) = 40 mm ± 0.1 %", "when(O.x, 0.02, 1) = 50 ms ± 0.1 %"], starts=4)  # fmt: skip
    stiffness = 0.5 * (np.pi / 0.1) ** 2
    assert found.possible
    assert found.values[K] == pytest.approx(stiffness, rel=3e-3)
    assert found.values[F] == pytest.approx(0.04 * stiffness / 2, rel=3e-3)


def test_what_cannot_be_had_is_said():
    found = optimise(block(), 0.3, free={K: (100.0, 180.0)}, subject_to=["max(O.x) = 100 mm"], starts=2)
    assert not found.possible and "none" in found.message and found.binding[0] == f"{K} = low end"


def test_a_thickness_that_can_be_bought():
    """The thinnest strip of a list whose first frequency is 10 Hz at least: f = pi/2/L^2 sqrt(E h^2/12 rho)."""

    def strip(thickness):
        return Mechanism(
            points={"A": (0.0, 0.0), "B": (0.3, 0.0)},
            links=[Link("strip", "A", "B", Beam(Section(0.02, thickness)))],
            joints=[Revolute("A", "ground", "strip")],
            guides=[Guide("B", "strip")],
        )

    offered = [2e-4, 3e-4, 4e-4, 5e-4]
    found = optimise(strip, free={"thickness": offered}, minimise="h", subject_to=["frequency(1) >= 10 Hz"],
                     readings={"h": lambda m: m.links[0].body.section.thickness})  # fmt: skip
    exact = [h for h in offered if np.pi / 2 / 0.3**2 * np.sqrt(210e9 * h**2 / 12 / 7850) >= 10]
    assert found.values["thickness"] == min(exact) == 4e-4 and found.possible
    assert frequencies(strip(4e-4), count=1).hertz[0] == pytest.approx(found.readings["frequency(1)"], rel=1e-6)


def test_a_front_of_two_aims():
    """A short way and a large push: the way is 2 F/k."""
    both = {"way": "max(O.x)", "push": lambda m: -m.loads[1].value[0]}
    found = optimise(block(), 0.4, free={F: (1.0, 5.0)}, minimise=both, starts=1, points=4)
    front = [(one.readings["way"], one.readings["push"]) for one in found.front]
    assert len(front) == 4
    for way, push in front:
        assert way == pytest.approx(-2 * push / 150, rel=1e-4)


def hoeken(ground, arm):
    """Hoeken's linkage over the half turn in which P goes straight: crank 1, coupler to its middle, rocker and arm alike."""
    start = np.pi / 2
    a, c = np.array([np.cos(start), np.sin(start)]), np.array([ground, 0.0])
    to = c - a
    along, far = to / np.hypot(*to), np.hypot(*to) / 2
    b = a + far * along + np.sqrt(arm**2 - far**2) * np.array([-along[1], along[0]])
    p = 2 * b - a
    names = {
        "O": (0.0, 0.0),
        "A": tuple(map(float, a)),
        "B": tuple(map(float, b)),
        "C": (float(ground), 0.0),
        "P": tuple(map(float, p)),
    }
    bar = Rigid(Section(0.02, 0.005))
    return Mechanism(
        points=names,
        links=[Link("crank", "O", "A", bar), Link("coupler", "A", "P", bar, carries={"B": 0.5}), Link("rocker", "C", "B", bar)],
        joints=[Revolute("O", "ground", "crank"), Revolute("A", "crank", "coupler"), Revolute("B", "coupler", "rocker"),
                Revolute("C", "ground", "rocker")],
        drives=[Drive("crank", np.pi)],
    )  # fmt: skip


def test_hoekens_straight_line():
    """Least rms off the line over half a turn, against the same by closed form; near the published 2 and 2.5 of the crank."""

    def off(x):
        angle = np.pi / 2 + np.pi * np.linspace(0, 1, 2001)
        a, c = np.exp(1j * angle), x[0]
        to = c - a
        b = a + to / 2 + 1j * to / abs(to) * np.sqrt(x[1] ** 2 - abs(to) ** 2 / 4)
        y = (2 * b - a).imag
        mean = np.trapezoid(y, angle) / np.pi
        return float(np.sqrt(np.trapezoid((y - mean) ** 2, angle) / np.pi))

    exact = minimize(
        off, [2.0, 2.5], method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-12}, bounds=[(1.6, 2.6), (2.2, 3.2)]
    )
    found = optimise(hoeken, 1.0, free={"ground": (1.6, 2.6), "arm": (2.2, 3.2)},
                     minimise="sqrt(mean(P.y*P.y) - mean(P.y)**2)", starts=4)  # fmt: skip
    best = found.readings["sqrt(mean(P.y*P.y) - mean(P.y)**2)"]
    assert best == pytest.approx(exact.fun, rel=0.02)
    assert off([found.values["ground"], found.values["arm"]]) == pytest.approx(best, rel=1e-3)


def test_constraints_as_text():
    assert wanted("max(B.x) = 1.5 N ± 1 %")[1:] == ("max(B.x)", 1.485, 1.515)
    assert wanted("end(B.x) >= 2 mm")[1:] == ("end(B.x)", 0.002, np.inf)
    assert wanted(("end(B.x)", 1, 2))[1:] == ("end(B.x)", 1.0, 2.0)
    with pytest.raises(ValueError, match="write for instance"):
        wanted("end(B.x) about 2 mm")
    with pytest.raises(ValueError, match="neither"):
        optimise(block(), 0.1, free={K: (100.0, 180.0)})


def test_command(tmp_path, capsys):
    from buckler.studies.kit.cli import main

    path = block().save(tmp_path / "block.toml")
    words = ["optimise", str(path), "--duration", "0.4s", "--free", f"{K}=1e2N/m:9e2N/m", "--starts", "2"]
    assert main(argv=[*words, "--subject-to", "max(O.x) = 10 mm ± 0.1 %"]) == 0
    said = capsys.readouterr().out
    assert abs(float(said.split(K)[1].split()[0]) - 600) < 2 and "binding" in said
    assert main(argv=[*words, "--subject-to", "max(O.x) = 1 m"]) == 1
    assert main(argv=[*words, "--subject-to", "max(O.x) is small"]) == 2
