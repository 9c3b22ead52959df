"""Published benchmark problems as mechanisms; `exact.published` has the numbers that they are held against."""

from __future__ import annotations

from math import cos, pi, sin

from buckler.mbs import Beam, Drive, Force, Guide, Link, Material, Mechanism, Revolute, Rigid, Section, Spring, Torque, Weld
from buckler.studies.kit.published import GRAVITY as G

# --- Andrews' squeezing mechanism: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section VII.7,
# --- doi 10.1007/978-3-642-05221-7

ANDREWS_START = (-0.0617138900142764496, 0.0, 0.455279819163070380, 0.222668390165885885, 0.487364979543842550,
                  -0.222668390165885885, 1.23054744454982120)  # fmt: skip
"""beta, theta, gamma, phi, delta, omega, epsilon at the start, rad."""
ANDREWS_BODIES = {
    "K1": (0.04325, 2.194e-6), "K2": (0.00365, 4.410e-7), "K3": (0.02373, 5.255e-6), "K4": (0.00706, 5.667e-7),
    "K5": (0.07050, 1.169e-5), "K6": (0.00706, 5.667e-7), "K7": (0.05498, 1.912e-5),
}  # fmt: skip
"""Mass, kg, and moment of inertia about the centre of mass, kg m^2."""


def andrews() -> Mechanism:
    """Seven bodies about the point E, a motor of 0.033 N m on K1 and a spring from C to D on K3; nothing weighs."""
    beta, theta, gamma, phi, delta, omega, epsilon = ANDREWS_START
    places = {"O": 0j, "A": -0.06934 - 0.00227j, "B": -0.03635 + 0.03273j, "C": 0.014 + 0.072j}
    places["F"] = 0.007 * _ray(beta)
    places["G"] = places["A"] + 0.04 * _ray(delta)
    places["H"] = places["A"] + 0.04 * _ray(epsilon - pi / 2)
    places["E"] = places["F"] - 0.028 * _ray(beta + theta)
    places["D"] = places["B"] + 0.02 * _ray(gamma) + 0.018 * _ray(gamma - pi / 2)
    centres = {
        "K1": 0.00092 * _ray(beta),
        "K2": places["F"] - 0.0115 * _ray(beta + theta),
        "K3": places["B"] + 0.01874 * _ray(gamma - pi / 2) + 0.01043 * _ray(gamma),
        "K4": places["E"] - 0.01421 * _ray(phi + delta - pi / 2),
        "K5": places["A"] + 0.02308 * _ray(delta) + 0.00916 * _ray(delta + pi / 2),
        "K6": places["E"] - 0.01421 * _ray(omega + epsilon),
        "K7": places["A"] + 0.01228 * _ray(epsilon - pi / 2) + 0.00449 * _ray(epsilon),
    }
    ends = dict(zip(ANDREWS_BODIES, ("OF", "FE", "BE", "GE", "AG", "HE", "AH"), strict=True))
    links = []
    for name, pair in ends.items():
        start, end = pair[0], pair[1]
        mass, inertia = ANDREWS_BODIES[name]
        along = places[end] - places[start]
        centre = (centres[name] - places[start]) * along.conjugate() / abs(along)
        body = Rigid.of(mass=mass, inertia=inertia, centre=(centre.real, centre.imag))
        links.append(Link(name, start, end, body, carries=["D"] if name == "K3" else ()))
    pins = [("O", "ground", "K1"), ("F", "K1", "K2"), ("B", "ground", "K3"), ("A", "ground", "K5"), ("A", "ground", "K7"),
            ("G", "K5", "K4"), ("H", "K7", "K6"), ("E", "K2", "K3"), ("E", "K2", "K4"), ("E", "K2", "K6")]  # fmt: skip
    return Mechanism(
        points={name: (place.real, place.imag) for name, place in places.items()},
        links=links,
        joints=[Revolute(*pin) for pin in pins],
        loads=[Torque("K1", 0.033), Spring("K3:D", "ground:C", stiffness=4530.0, free_length=0.07785)],
    )


def _ray(angle: float) -> complex:
    return complex(cos(angle), sin(angle))


# --- N four-bar mechanism: M. Gonzalez et al., doi 10.1007/s11044-006-9020-8, problem A02


def four_bars(windows: int = 2) -> Mechanism:
    """N + 1 upright bars of 1 m and 1 kg, their tops joined by N like bars; they turn through level, singular poses."""
    bar = Rigid.of(mass=1.0, inertia=1 / 12)
    feet = {f"A{k}": (float(k), 0.0) for k in range(windows + 1)}
    tops = {f"B{k}": (float(k), 1.0) for k in range(windows + 1)}
    links = [Link(f"bar{k}", f"A{k}", f"B{k}", bar) for k in range(windows + 1)]
    links += [Link(f"coupler{k}", f"B{k}", f"B{k + 1}", bar) for k in range(windows)]
    pins = [Revolute(f"A{k}", "ground", f"bar{k}") for k in range(windows + 1)]
    for k in range(windows):
        pins += [Revolute(f"B{k}", f"bar{k}", f"coupler{k}"), Revolute(f"B{k + 1}", f"coupler{k}", f"bar{k + 1}")]
    return Mechanism({**feet, **tops}, links, pins, velocities={"bar0": -1.0}, gravity=(0.0, -G))


# --- Princeton beam in its plane: E. H. Dowell, J. Traybar (1975); values of beam elements, doi 10.1007/s11071-022-07518-z

PRINCETON_LENGTH = 0.508
PRINCETON = Section(12.3777e-3, 3.2024e-3, Material(modulus=71.7e9, density=2804.0, poisson=0.31))
"""Aluminium 7075, bent across its thickness."""


def princeton(load: float) -> Mechanism:
    """A cantilever with a dead load, N, across its tip."""
    return Mechanism(
        points={"A": (0.0, 0.0), "B": (PRINCETON_LENGTH, 0.0)},
        links=[Link("beam", "A", "B", Beam(PRINCETON))],
        joints=[Weld("A", "ground", "beam")],
        loads=[Force("B", (0.0, -load))],
    )


# --- Simeon's flexible slider-crank: B. Simeon, doi 10.1080/13873959608837026; test set, release 2.4, problem "Slider crank"

SIMEON_STEEL = Section(0.008, 0.008, Material(modulus=0.20e12, density=7870.0, poisson=0.3))


def simeon() -> Mechanism:
    """A rigid crank of 0.15 m, a steel rod of 0.3 m and 8 x 8 mm that bends and stretches, a block of 75.6 g."""
    return Mechanism(
        points={"O": (0.0, 0.0), "A": (0.15, 0.0), "B": (0.45, 0.0)},
        links=[Link("crank", "O", "A", Rigid.of(mass=0.36, inertia=0.002727)), Link("rod", "A", "B", Beam(SIMEON_STEEL))],
        joints=[Revolute("O", "ground", "crank"), Revolute("A", "crank", "rod")],
        guides=[Guide("B", "rod", mass=0.075552)],
        drives=[Drive("crank", 150.0)],
    )


# --- pendulums: M. Gonzalez et al., doi 10.1007/s11044-006-9020-8


def double_pendulum() -> Mechanism:
    """Two uniform rods of 1 m and 1 kg, let go level and at rest."""
    rod = Rigid.of(mass=1.0, inertia=1 / 12)
    return Mechanism(
        points={"O": (0.0, 0.0), "A": (1.0, 0.0), "B": (2.0, 0.0)},
        links=[Link("first", "O", "A", rod), Link("second", "A", "B", rod)],
        joints=[Revolute("O", "ground", "first"), Revolute("A", "first", "second")],
        gravity=(0.0, -G),
    )
