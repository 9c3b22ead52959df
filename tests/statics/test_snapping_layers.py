"""Layers of bowed strips that snap one after the other, each at the limit of one strip of `buckler.elastica`, less weights above.

Layers in series carry the same force but for the weights of what is above. All are alike, so each snaps at a strip's limit, less
these weights, and those that have snapped stay: the lowest is the first to snap and the last to snap back.
"""

from math import atan2, hypot, pi

import numpy as np
import pytest
from exact.strip_paths import follow

from buckler.elastica.strip import Load, Strip
from buckler.mbs import Cable, Force, Guide, Link, Mechanism, Revolute, Rigid, Section, path

HALF, RISE, POST, BOW = 0.1, 0.03, 0.05, 0.015
SECTION = Section(width=0.010, thickness=1e-3)


def layers(high, roofs, weight):
    """Bars that move upright, on roofs of two strips each; a weight on each but the highest, which a force pushes down."""
    wide = 2 * HALF * roofs
    points = {f"F0_{i}": (2 * HALF * i, 0.0) for i in range(roofs + 1)}
    links, joints, guides, loads = [], [], [], []
    for k in range(1, high + 1):
        top, bar = k * (RISE + POST), f"bar{k}"
        feet = {f"F{k}_{i}": (2 * HALF * i, top) for i in range(roofs + 1)}
        heads = {f"H{k}_{i}": (HALF * (2 * i + 1), top - POST) for i in range(roofs)}
        middle = {f"G{k}": (wide / 2, top), f"P{k}": (wide / 2, top - POST)}
        points |= {f"L{k}": (0.0, top), f"R{k}": (wide, top), **feet, **heads, **middle}
        links.append(Link(bar, f"L{k}", f"R{k}", Rigid.of(mass=0.1, inertia=1e-3), carries=[*middle, *feet, *heads]))
        guides += [Guide(name, bar, along=(0, 1)) for name in middle]
        loads.append(Force(f"{bar}:G{k}", (0.0, -weight)) if k < high else Force(f"{bar}:P{k}", (0.0, -1.0)))
        for i, head in enumerate(heads):
            for side, foot in ((1, f"F{k - 1}_{i}"), (-1, f"F{k - 1}_{i + 1}")):
                strip = f"strip{foot}{head}"
                links.append(Link(strip, foot, head, Cable(SECTION, imperfection=side * BOW)))
                joints += [Revolute(foot, f"bar{k - 1}" if k > 1 else "ground", strip), Revolute(head, strip, bar)]
    return Mechanism(points, links, joints, guides=guides, loads=loads)


def snap():
    """Largest force along the rise on one strip, pinned below, its upper pin on an upright line, N; x of `Strip` is upright."""
    chord, angle = hypot(HALF, RISE), pi * BOW / hypot(HALF, RISE)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    length = chord / float(weights @ np.cos(angle * np.cos(pi * (nodes + 1) / 2)) / 2)
    unit = SECTION.bending_stiffness / length**2
    strip = Strip("pinned", "roller", lambda s: atan2(HALF, RISE) - angle * np.cos(pi * s), SECTION.axial_stiffness / unit)
    return follow(strip, Load(end=(-1.0, 0.0)), to=20.0 / unit).limits[0].factor * unit


def expected(high, roofs, weight):
    """Forces at which the layers snap, from the lowest on, each then snapping back at the last."""
    largest, above = 2 * roofs * snap(), weight * np.arange(high - 1, -1, -1)
    return np.column_stack([largest - above, -largest - above]).ravel()


def test_layers_snap_one_after_the_other_and_tell_by_how_much_their_limits_are_off():
    found = path(layers(2, 1, 1.5), load="force.P2", to=30.0, longest=0.3, degree=8)
    off = np.abs(found.limits - expected(2, 1, 1.5))
    assert found.status == "OK" and not found.branchings and found.unstable[-1] == 0
    assert off == pytest.approx(found.errors["limits"], rel=1e-2) and off.max() < 4e-3
    assert found.point("bar2", "P2")[-1, 1] < 2 * (RISE + POST) - POST - 2 * 2 * RISE


@pytest.mark.slow
def test_more_layers_do_so_as_exactly_as_paths_are_by_default():
    found = path(layers(3, 2, 3.0), load="force.P3", to=60.0)
    assert found.status == "OK" and not found.branchings
    assert found.limits == pytest.approx(expected(3, 2, 3.0), rel=1e-6)
    assert found.errors["limits"].max() < 1e-5 * np.abs(found.limits).max()
