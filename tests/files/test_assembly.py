"""Poses from lengths and angles: against closed forms of loops, and what cannot be assembled."""

from dataclasses import replace
from math import cos, hypot, pi, sin, sqrt

import numpy as np
import pytest

from buckler.mbs import Drive, Guide, Link, Mechanism, Revolute, Rigid, Section, simulate
from buckler.mbs.assembly import assemble
from buckler.mbs.documents.document import read
from buckler.mbs.library import CrankRocker
from buckler.mbs.units import parse_quantity
from buckler.studies.kit.cli import EXAMPLES

SIX_BAR = {name: each for name, each in read(EXAMPLES / "stephenson.toml").items() if name not in ("about", "run")}
"""Crank 105 mm at 60 degrees, coupler 272 mm, rocker 175 mm, rod 400 mm from 130 mm along and 60 mm beside it, output 220 mm."""
LENGTHS = CrankRocker()


def with_link(content, name, **fields):
    return {**content, "links": {**content["links"], name: {**content["links"][name], **fields}}}


def four_bar(**more):
    bar, (a, b, c, d) = Rigid(Section(0.02, 0.005)), LENGTHS
    links = [Link("crank", "O", "A", bar, length=a, angle="60 deg"), Link("coupler", "A", "B", bar, length=b)]
    return Mechanism(points={"O": (0, 0), "C": (d, 0)}, links=[*links, Link("rocker", "C", "B", bar, length=c)], **more)


def circles(p, r, q, s):
    """Both points at distance r from p and s from q, the one on the left of p-q first (complex numbers)."""
    d = q - p
    along = (r**2 - s**2 + abs(d) ** 2) / (2 * abs(d))
    height = sqrt(r**2 - along**2)
    return [p + d / abs(d) * (along + 1j * side * height) for side in (1, -1)]


def test_four_bar_in_both_assemblies():
    mechanism = four_bar()
    places = LENGTHS.places(pi / 3)
    for point in "AB":
        assert mechanism.points[point] == pytest.approx(places[point], abs=1e-13)
    (other,) = mechanism.assemblies().others
    crossed = circles(complex(*places["A"]), LENGTHS.coupler, LENGTHS.frame, LENGTHS.rocker)[1]
    assert other["B"] == pytest.approx((crossed.real, crossed.imag), abs=1e-13)
    chosen = four_bar(near={"B": (0.1, -0.1)})
    assert chosen.points["B"] == pytest.approx(other["B"], abs=1e-13)
    assert Mechanism.from_dict(chosen.to_dict()) == chosen and chosen.to_dict()["points"].keys() == {"O", "C"}


def test_stephenson_six_bar_in_all_four_assemblies():
    """The crank's loop closes in two ways, and in each the second loop in two."""
    mechanism = Mechanism.from_dict(SIX_BAR)
    a = 0.105 * np.exp(1j * pi / 3)
    expected = []
    for b in circles(a, 0.272, 0.225, 0.175):
        d = a + (b - a) / 0.272 * (0.130 + 0.060j)
        try:
            expected += [(b, e) for e in circles(d, 0.400, 0.4 - 0.1j, 0.220)]
        except ValueError:  # out of reach there
            continue
    found = mechanism.assemblies()
    poses = [found.points, *found.others]
    assert len(poses) == len(expected) >= 2
    for b, e in expected:
        off = [abs(complex(*pose["B"]) - b) + abs(complex(*pose["E"]) - e) for pose in poses]
        assert min(off) < 1e-12
    assert simulate(mechanism, 0.05).status == "OK"


def test_slider_on_a_line_through_a_point():
    bar, angle = Rigid(Section(0.02, 0.005)), 0.7
    mechanism = Mechanism(
        points={"O": (0.01, 0.02)},
        links=[Link("crank", "O", "A", bar, length=0.1, angle=angle), Link("rod", "A", "B", bar, length=0.3)],
        guides=[Guide("B", "rod", along=(-1, 0), through="O")],
        joints=[Revolute("O", "ground", "crank"), Revolute("A", "crank", "rod")],
        drives=[Drive("crank", 6.0)],
    )
    ends = [0.01 + 0.1 * cos(angle) + side * sqrt(0.3**2 - (0.1 * sin(angle)) ** 2) for side in (1, -1)]
    assert mechanism.points["B"] == pytest.approx((ends[0], 0.02), abs=1e-13)
    assert mechanism.assemblies().others[0]["B"] == pytest.approx((ends[1], 0.02), abs=1e-13)
    with pytest.raises(ValueError, match=r"guide of 'B': through = 'O': lies 0.02 m beside its line"):
        replace(mechanism, points={**mechanism.points, "B": (mechanism.points["B"][0], 0.04)}, links=[
            Link(link.name, link.start, link.end, bar) for link in mechanism.links])  # fmt: skip


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: with_link(c, "rod", length=0.9), r"links: out of reach, no pose has these lengths; at best .*'rod' "),
        (lambda c: with_link(c, "crank", angle=None), r"angles leave 1 way open; give an angle more, as links.crank.angle"),
        (lambda c: {**c, "points": {**c["points"], "A": [0.1, 0.1]}}, r"links.crank: length of link 'crank' = 0.105 m: .* 0.141"),
        (lambda c: {**c, "near": {"C": [0, 0]}}, r"near.C: no point whose place follows from lengths; those are: A, B, D, E"),
        (lambda c: with_link(c, "rod", length="-3 mm"), r"links.rod.length = -3 mm: must lie in \(0, inf\) m"),
        (lambda c: {**c, "pins": ["A crank coupler"]}, r"pins\[0\] = 'A crank coupler': write a point and two links"),
        (lambda c: {**c, "pins": ["A: crank copler"]}, r"pins\[0\] = .*unknown link 'copler', did you mean 'coupler'"),
        (lambda c: {**c, "pins": "A: crank coupler"}, r"pins = 'A: crank coupler': must be a list"),
        (lambda c: {**c, "defaults": {"bodies": {}}}, r"defaults.bodies: unknown key, did you mean 'body'"),
        (lambda c: {**c, "default": {}}, r"default: unknown key, did you mean 'defaults'"),
        (lambda c: {**c, "defaults": {}}, r"links.crank: lacks 'body'"),
    ],
)  # fmt: skip
def test_what_cannot_be_assembled_is_one_line_with_its_place(change, message):
    with pytest.raises(ValueError, match=message) as error:
        Mechanism.from_dict(change(SIX_BAR))
    assert "\n" not in str(error.value)


def test_a_dead_centre_is_no_pose_to_start_from():
    content = with_link(SIX_BAR, "crank", angle=0.0, length=0.1)
    content["links"]["rocker"] = {**content["links"]["rocker"], "length": 0.125 + 0.272}
    with pytest.raises(ValueError, match="dead centre"):
        Mechanism.from_dict(content)


def test_links_may_be_listed_with_their_names():
    listed = {**SIX_BAR, "links": [{"name": name, **link} for name, link in SIX_BAR["links"].items()]}
    assert Mechanism.from_dict(listed) == Mechanism.from_dict(SIX_BAR)


def test_defaults_fill_what_is_left_out_and_nothing_else():
    law = {"kind": "Impact", "stiffness": 1e8, "damping": 10, "damping_depth": 1e-5}
    joint = {"kind": "Clearance", "pin": "5 mm", "gap": "0.1 mm", "law": law}
    own = {"kind": "Revolute", "point": "O", "first": "ground", "second": "crank"}
    wider = {"point": "A", "first": "crank", "second": "coupler", "gap": "0.2 mm"}
    content = {
        **SIX_BAR,
        "defaults": {**SIX_BAR["defaults"], "joint": joint},
        "joints": [own, wider],
        "pins": SIX_BAR["pins"][2:],
    }
    content = with_link(content, "rod", body={"kind": "Rigid", "mass": 1.0, "inertia": 1.0})
    content = with_link(content, "output", body={"section": {"thickness": "8 mm"}})
    mechanism = Mechanism.from_dict(content)
    kinds = [type(joint).__name__ for joint in mechanism.joints]
    assert kinds == ["Revolute", *["Clearance"] * 6]
    assert [joint.gap for joint in mechanism.joints[1:3]] == [2e-4, 1e-4]
    assert mechanism.link("rod").body == Rigid.of(mass=1.0, inertia=1.0)
    assert mechanism.link("output").body.section == Section(0.02, 0.008)
    assert Mechanism.from_dict(mechanism.to_dict()) == mechanism


def test_random_four_bars_have_both_poses_or_none():
    """Lengths over six decades, any angle: two poses where coupler and rocker reach each other, an error elsewhere."""
    random, closed = np.random.default_rng(3), 0
    bar = Rigid(Section(0.02, 0.005))
    for _ in range(40):
        a, b, c = random.uniform(0.02, 1, 3) * 10 ** random.uniform(-3, 3)
        d, angle = random.uniform(0.1, 1) * max(a, b, c), random.uniform(-pi, pi)
        start, frame = a * np.exp(1j * angle), complex(d)
        links = [Link("a", "O", "A", bar, length=a, angle=angle), Link("b", "A", "B", bar, length=b)]
        links.append(Link("c", "C", "B", bar, length=c))
        if abs(b - c) < abs(frame - start) < b + c:
            found = assemble({"O": (0, 0), "C": (d, 0)}, links)
            expected = sorted(circles(start, b, frame, c), key=lambda z: -z.imag)
            poses = [complex(*pose["B"]) for pose in (found.points, *found.others)]
            assert np.array(poses) == pytest.approx(np.array(expected), abs=1e-9 * max(a, b, c))
            closed += 1
        else:
            with pytest.raises(ValueError, match="out of reach"):
                assemble({"O": (0, 0), "C": (d, 0)}, links)
    assert closed > 10


def test_six_bar_by_the_angle_of_its_output_has_a_loop_that_no_dyad_closes():
    """Crank, coupler, rocker and rod then hang together (a triad).

    A scan of the crank in both branches finds as many poses: roots of the length of the rod over its angle.
    """
    mechanism = Mechanism.from_dict(SIX_BAR)
    end, pivot = complex(*mechanism.points["E"]), complex(*mechanism.points["F"])
    turned = with_link(SIX_BAR, "output", angle=float(np.angle(end - pivot)))
    turned["links"]["crank"] = {key: each for key, each in turned["links"]["crank"].items() if key != "angle"}
    a = 0.105 * np.exp(1j * np.linspace(-pi, pi, 20001))
    apart = np.abs(0.225 - a)
    along = (0.272**2 - 0.175**2 + apart**2) / (2 * apart)
    height = np.sqrt(0.272**2 - along**2)  # a crank that turns fully: real at every angle
    count = 0
    for side in (1, -1):
        b = a + (0.225 - a) / apart * (along + 1j * side * height)
        left = np.abs(a + (b - a) / 0.272 * (0.130 + 0.060j) - end) - 0.400
        count += int((np.diff(np.sign(left)) != 0).sum())
    found = Mechanism.from_dict(turned).assemblies()
    poses = [found.points, *found.others]
    assert len(poses) == count >= 2
    for pose in poses:
        points = {"O": (0, 0), "C": (0.225, 0), "F": (0.4, -0.1), **pose}
        for link in turned["links"].values():
            apart = hypot(*np.subtract(points[link["end"]], points[link["start"]]))
            assert apart == pytest.approx(parse_quantity(link["length"], "m"), abs=1e-12)
    ours = np.array([mechanism.points[point] for point in "ABDE"])
    assert min(np.abs(np.array([pose[point] for point in "ABDE"]) - ours).max() for pose in poses) < 1e-10
