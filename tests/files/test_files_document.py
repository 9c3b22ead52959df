"""Mechanisms as files: there and back, with units, formulas and tables; every error one line with its place."""

import importlib
import json
import pickle

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from buckler import mbs
from buckler.elastica import law
from buckler.mbs import Beam, Drive, Link, Mechanism, Motion, Revolute, Rigid, Section, Strut, slider_crank
from buckler.mbs.declare import register
from buckler.mbs.documents.document import change
from buckler.mbs.functions import Components, Expression, Table
from buckler.mbs.laws import CarvalhoMartins, Impact
from buckler.studies.kit.drawn import EVERYTHING, draw

CALM = {"deadline": None, "suppress_health_check": list(HealthCheck), "derandomize": True, "database": None}


def arm(**changes):
    content = {
        "points": {"O": [0, 0], "A": ["140 mm", 0]},
        "links": {"arm": {"start": "O", "end": "A", "body": {"kind": "Beam", "section": {"width": 0.03, "thickness": "0.3 mm"}}}},
        "joints": [{"kind": "Revolute", "point": "O", "first": "ground", "second": "arm"}],
    }
    return change(content, changes)


def refused(content):
    with pytest.raises(ValueError) as error:
        Mechanism.from_dict(content)
    message = str(error.value)
    assert "\n" not in message and len(message) < 600
    return message


def there_and_back(mechanism, folder):
    for name in ("m.toml", "m.json"):
        assert Mechanism.load(mechanism.save(folder / name)) == mechanism
    assert Mechanism.from_dict(mechanism.to_dict()) == mechanism
    assert pickle.loads(pickle.dumps(mechanism)) == mechanism


@pytest.mark.parametrize("family", EVERYTHING)
def test_drawn_mechanisms_survive_a_file(family, tmp_path):
    for k in range(10):
        there_and_back(draw(3, k, (family,)).mechanism, tmp_path)


def named_oddly():
    """A chain whose names need quotes in a file, with functions of every form, shapes, a material, modes of a solid."""
    bar, soft = Section(0.02, 1 / 300), Section(0.03, 3e-4, mbs.Material(modulus=7e10, density=2700.0, poisson=-0.2))
    formula, table = Expression("0.1*sin(pi*s)"), Table((0, 1, 2.5), (0.0, -3.0, 2.0), smooth=True)
    solid = mbs.Modal(bar, mbs.modal.FreeModes((1, 2), "free"), (0.1, 0.2), mbs.modal.Box((9, 2, 1)), mbs.modal.PinHole(0.005))
    bodies = {
        'q"uote': Rigid(bar), "link 2": Beam(soft, shape=Components((Expression("s"), formula))), "Schwinge κ": solid,
        "a-b": mbs.Cable(soft, shape=[(0, 0), (0.5, 0.1), (1, 0)]), "=": Strut(soft, law.quartic),
    }  # fmt: skip
    names = list(bodies)
    links = [Link(name, f"P{k}", f"P{k + 1}", body) for k, (name, body) in enumerate(bodies.items())]
    joints = [Revolute(f"P{k}", names[k - 1] if k else "ground", name) for k, name in enumerate(names)]
    loads = [
        mbs.Force("P2", Components((table, 1.5))), mbs.Torque(names[0], Expression("2")),
        mbs.Spring("P3", "ground:P0", 0.0, law=Expression("50*x + 2*v")),
    ]  # fmt: skip
    drive = Drive(names[0], Motion(Expression("t**2"), Expression("2*t")))
    points = {f"P{k}": (k + 1 / 3, 0.1 * k) for k in range(6)}
    return Mechanism(points, links, joints, drives=[drive], loads=loads, velocities={"P5": (0.1, -2.0)}, gravity=(-np.pi, 1e-9))


def test_names_in_quotes_functions_and_modes_survive_a_file(tmp_path):
    there_and_back(named_oddly(), tmp_path)


def test_a_link_with_points_by_name_and_by_fraction_survives_a_file(tmp_path):
    link = Link("arm", "O", "A", Rigid(Section(width=0.03, thickness=5e-3)), carries={"D": 0.5, "E": None})
    points = {"O": (0, 0), "A": (0.2, 0), "E": (0.1, 0.05)}
    there_and_back(Mechanism(points, [link], [Revolute("O", "ground", "arm")]), tmp_path)


def test_an_entry_whose_name_stands_twice_in_it_is_one_entry():
    assert change({"springs": [{"name": "A", "a": "A"}]}, {"springs.A.stiffness": 1.0})["springs"][0]["stiffness"] == 1.0


def test_numbers_with_units_are_the_same_floats():
    mechanism = Mechanism.from_dict(arm(gravity=[0, "-9.81 m/s^2"], velocities={"arm": "30 deg/s"}))
    section = mechanism.link("arm").body.section
    assert (section.thickness, mechanism.points["A"], mechanism.gravity) == (3e-4, (0.14, 0.0), (0.0, -9.81))
    assert {type(x) for x in (section.thickness, *mechanism.points["A"], *mechanism.gravity)} == {float}
    assert mechanism.velocities["arm"] == pytest.approx(np.pi / 6, rel=1e-15)


def test_the_short_form_of_a_rigid_link():
    body = {"kind": "Rigid", "mass": "170 g", "inertia": "2.9e-4 kg m^2", "centre": ["50 mm", 0]}
    mechanism = Mechanism.from_dict(arm(**{"links.arm.body": body}))
    assert mechanism.link("arm").body == Rigid.of(mass=0.17, inertia=2.9e-4, centre=(0.05, 0))
    assert mechanism.to_dict()["links"]["arm"]["body"]["mass"] == 0.17


def test_a_material_by_its_name():
    """Mass of a bar of PLA, 140 mm x 30 mm x 5 mm at 1240 kg/m^3, by hand; the name may be the default of all sections."""
    bar = {"kind": "Rigid", "section": {"width": "30 mm", "thickness": "5 mm", "material": "PLA"}}
    made = Mechanism.from_dict(arm(**{"links.arm.body": bar})).link("arm").body.section
    assert made.mass_per_length * 0.140 == pytest.approx(0.02604)
    section = {"width": "30 mm", "thickness": "5 mm"}
    usual = arm(**{"links.arm.body": {"kind": "Rigid", "section": section}})
    usual["defaults"] = {"section": {"material": "aluminium"}}
    assert Mechanism.from_dict(usual).link("arm").body.section.material.modulus == 70e9
    wrong = arm(**{"links.arm.body": {**bar, "section": {**section, "material": "stel"}}})
    said = "links.arm.body.section.material = 'stel': unknown material, did you mean 'steel'?; known: steel,"
    assert refused(wrong).startswith(said)


def test_speeds_by_formula_and_table():
    drives = [{"target": "arm", "speed": "2*cos(3*t)"}]
    rigid = {"links.arm.body": {"kind": "Rigid", "section": {"width": 0.03, "thickness": 0.01}}, "drives": drives}
    motion = Mechanism.from_dict(arm(**rigid)).drives[0].motion
    for t in (0.0, 0.4, 2.7):
        assert motion.position(t) == pytest.approx(2 / 3 * np.sin(3 * t), abs=1e-13)
        assert motion.speed(t) == 2 * np.cos(3 * t)
    rigid["drives"] = [{"target": "arm", "speed": {"kind": "Motion", "position": "sin(3*t)/3"}}]
    assert refused(arm(**rigid)) == "drives[0].speed: lacks 'speed' (derivative of the position by t)"
    rigid["drives"] = [{"target": "arm", "speed": {"kind": "Table", "times": ["0 s", "1 s", 2], "values": [0, 2, 2]}}]
    motion = Mechanism.from_dict(arm(**rigid)).drives[0].motion
    assert (motion.speed(0.5), motion.position(2.0)) == (1.0, pytest.approx(3.0, rel=1e-12))


def test_a_law_of_ones_own_by_register(tmp_path):
    from dataclasses import dataclass

    @dataclass(frozen=True)
    class Rubber(Impact):
        """As Impact."""

    mechanism = slider_crank(Strut(Section(0.03, 3e-4)), law=Rubber(1e5, 1, 1e-3), mass=0.3, speed=1)
    with pytest.raises(ValueError, match=r"stops\[0\].law: a Rubber has no name in a file.*register"):
        mechanism.to_dict()
    try:
        register(Rubber)
        assert Mechanism.from_dict(mechanism.to_dict()) == mechanism
    finally:
        importlib.import_module("buckler.mbs.declare.declared")._KINDS.pop("Rubber")


def test_a_python_function_is_refused_with_its_place():
    mechanism = Mechanism(
        {"O": (0, 0), "A": (1, 0)},
        [Link("arm", "O", "A", Rigid(Section(0.1, 0.1)))],
        [Revolute("O", "ground", "arm")],
        drives=[Drive("arm", Motion(lambda t: t, lambda t: 1.0))],
    )
    with pytest.raises(ValueError, match=r"drives\[0\].speed.position: the function <lambda> has no name in a file; take a for"):
        mechanism.to_dict()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"links.arm.body.section.thicknes": 1}, "links.arm.body.section.thicknes: unknown key, did you mean 'thickness'?"),
        ({"links.arm.body.section.thickness": "3 kg"}, "links.arm.body.section.thickness = 3 kg: must be in m"),
        ({"links.arm.body.section.thickness": "-1 mm"}, "links.arm.body.section.thickness = -1 mm: must lie in [1e-09, 1e+06] m"),
        ({"links.arm.body.section.thickness": "thin"}, "links.arm.body.section.thickness = 'thin': not a number; must be a"),
        ({"links.arm.body.section.thickness": True}, "links.arm.body.section.thickness = true: must be a number"),
        ({"links.arm.body.section": 3}, "links.arm.body.section = 3: must be Profile or Section (in files a table"),
        ({"links.arm.body.elements": 2.5}, "links.arm.body.elements"),
        ({"links.arm.body.kind": "Bean"}, "links.arm.body.kind = 'Bean': unknown kind, did you mean 'Beam'?"),
        ({"links.arm.end": "B"}, "links.arm.end: link 'arm': unknown point 'B'; known: A, O"),
        ({"links.arm": 1}, "links.arm = 1: must be Link (in files a table)"),
        ({"links": []}, "links: a mechanism needs at least one link"),
        ({"points.A": [1]}, "points.A = [1]"),
        ({"points.A": [1, "2 s"]}, "points.A.y = 2 s: must be in m"),
        ({"joints[0].point": "Q"}, "joints[0].point: joint at 'Q': unknown point 'Q'"),
        ({"joints[0].second": "alm"}, "joints[0].second: joint at 'O': unknown link 'alm'"),
        ({"joints[0].kind": "Clearance"}, "joints[0]: lacks 'pin' (radius of the pin)"),
        ({"joints": 3}, "joints = 3: must be a list, each Clearance or Revolute or"),
        ({"gravity": "9.81"}, "gravity = '9.81'"),
        ({"pionts": {}}, "pionts: unknown key, did you mean 'points'?"),
        ({"drives": [{"target": "arm", "speed": "2*sin(tt)"}]}, "drives[0].speed = '2*sin(tt)': unknown name 'tt'"),
        ({"drives": [{"target": "arm", "speed": "3 m^"}]}, "drives[0].speed = '3 m^': unknown unit 'm^'"),
        ({"drives": [{"target": "arm", "speed": "3 kg"}]}, "drives[0].speed = 3 kg: must be in rad/s or m/s"),
        ({"drives": [{"target": "arm"}]}, "drives[0]: lacks 'speed'"),
    ],
)  # fmt: skip
def test_an_error_begins_with_its_place(changes, message):
    assert refused(arm(**changes)).startswith(message)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("m.toml", "points = [", "m.toml: no valid TOML"),
        ("m.toml", "x = 0.3mm", "m.toml: no valid TOML: Expected newline or end of document after a statement (at line 1, col"),
        ("m.json", "{", "m.json: no valid JSON"),
        ("m.json", '{"a": 1, "a": 2}', "m.json: no valid JSON: the key 'a' stands twice"),
        ("m.json", "[1]", "m.json: must be a table, not a list"),
        ("m.json", "[" * 100_000, "m.json: no valid JSON"),
        ("m.toml", "", "m.toml: lacks 'points'"),
        ("m.yaml", "", "m.yaml: a mechanism's file ends in .toml or .json"),
    ],
)
def test_files_that_are_none(tmp_path, monkeypatch, name, content, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_text(content)
    with pytest.raises(ValueError) as error:
        Mechanism.load(name)
    assert str(error.value).startswith(message) and "\n" not in str(error.value)


EXAMPLE = slider_crank(
    Beam(Section(0.03, 3e-4)), law=CarvalhoMartins(1e5, 0.5), mass=0.3, speed=Expression("1.25*(1-exp(-t/0.2))")
).to_dict() | {"gravity": [0.0, -9.81]}
EXAMPLE["joints"][1] = {
    "kind": "Clearance", "point": "A", "first": "crank", "second": "coupler", "pin": 5e-3, "gap": 1e-4,
    "law": {"kind": "Impact", "stiffness": 1e6, "damping": 10.0, "damping_depth": 1e-4},
}  # fmt: skip
ODD = st.sampled_from(
    [None, True, -1, 0, 1e400, float("nan"), 10**400, "", "ground", "3 kg", "sin(", "__import__('os')", "none", [], {}, [[1]],
     {"kind": "Beam"}, {"kind": 3}, "A\x00\n", [1, 2, 3], {"x": {}}, "1e999 m", "t.real", "9**9**9"]
)  # fmt: skip


def places(content, path=()):
    yield path
    entries = content.items() if isinstance(content, dict) else enumerate(content) if isinstance(content, list) else ()
    for key, each in entries:
        yield from places(each, (*path, key))


def mutilated(draw, content):
    """A document with one place removed, renamed, replaced or doubled."""
    content = json.loads(json.dumps(content))
    *way, last = draw(st.sampled_from([p for p in places(content) if p]))
    place = content
    for step in way:
        place = place[step]
    match draw(st.sampled_from(["replace", "remove", "rename", "add"])):
        case "replace":
            place[last] = draw(ODD)
        case "remove":
            del place[last]
        case "rename":
            each = place.pop(last)
            place.insert(0, each) if isinstance(place, list) else place.update({f"{last}x": each})
        case _:
            place.append(draw(ODD)) if isinstance(place, list) else place.update({"odd": draw(ODD)})
    return content


def one_clear_line(data):
    content = mutilated(data.draw, EXAMPLE)
    try:
        Mechanism.from_dict(content)
    except ValueError as error:
        message = str(error)
        assert "\n" not in message and 10 < len(message) < 700, message
        place = message.partition(":")[0].partition(" = ")[0]
        top = place.partition(".")[0].partition("[")[0]
        assert top in {*content, *EXAMPLE, "mechanism"} or message.startswith("lacks '"), message


@pytest.mark.parametrize("count", [100, pytest.param(1000, marks=pytest.mark.slow)])
def test_mutilated_documents_give_one_line_with_the_place(count):
    settings(max_examples=2 * count, **CALM)(given(st.data())(one_clear_line))()
