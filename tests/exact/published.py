"""Published numbers of benchmark problems, and the exact ones computed here."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Number:
    """A number, its unit, how many of its digits are published or certain (absolute), and where it is from."""

    value: float
    unit: str
    within: float
    source: str


ANDREWS_ANGLES = (
    15.81077119949904,
    -15.75637105984298,
    0.04082224013073101,
    -0.5347301163226499,
    0.5244099658805304,
    0.5347301163226499,
    1.048080741042263,
)
"""Angles beta, theta, gamma, phi, delta, omega, epsilon at 0.03 s, rad: test set for initial value problem solvers. The
integration here ends at beta = 15.8107711952, 4e-9 below.
"""

SIMEON_END = (
    15.0,
    -3.311734987256600e-01,
    1.697373328427860e-01,
    1.893192899613509e-04,
    2.375751249879174e-05,
    -5.323896770569702e-06,
    -8.363313279112129e-06,
    150.0,
    6.025346755138369e01,
    -8.753116326670527e00,
    -3.005541400289738e-02,
    -5.500431812571696e-03,
    4.974111734266989e-04,
    1.105560003626645e-03,
)
"""p1, p2 (rad), x3 (m), q1 ... q4 (m) and their rates at 0.1 s: test set, linear stiffness, no damping."""

DOUBLE_PENDULUM = {
    "points": (-0.6271867050665073, -1.3013155502098117, 2.1254086738429107, 3.8818887272656074),
    "rods": (1.1385437966718797, 1.2443799277502558, 4.910950024004454, -5.424710593158876),
}
"""Angles, rad, and rates, rad/s, 5 s after the double pendulum of 1 m and 1 kg was let go level: a Taylor series in 40 digits."""

PUBLISHED = {
    "andrews.beta": Number(15.81077, "rad", 5e-6, "Hairer, Wanner, doi 10.1007/978-3-642-05221-7, section VII.7"),
    "four_bar_n2.x": Number(0.32846, "m", 5e-6, "doi 10.1007/s11044-006-9020-8, A02; 10 s after release with vx = +1 m/s"),
    "four_bar_n2.y": Number(0.94452, "m", 5e-6, "the same"),
    "princeton.tip": Number(
        0.146245978, "m", 5e-5, "doi 10.1007/s11071-022-07518-z, beam elements, 8.896 N across the thin side"
    ),
    "princeton.tip_13": Number(0.200677707, "m", 5e-5, "the same, 13.345 N"),
    "simeon.slider": Number(SIMEON_END[2], "m", 1e-9, "test set for initial value problem solvers, x3 at 0.1 s"),
    "simeon.rod": Number(SIMEON_END[1], "rad", 1e-9, "the same, angle of the rod"),
    "deep_arch": Number(8.97, "P R^2/(E I)", 5e-3, "DaDeppo, Schmidt, J. Appl. Mech. 42 (1975): clamped-hinged, 215 degrees"),
    "portal.sway": Number(3.2046, "sqrt(E I/(rho A L^4))", 1e-3, "slender portal of equal members, clamped feet"),
}
