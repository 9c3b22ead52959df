"""Equilibria of mechanisms drawn far from rest, and what has none, against closed forms."""

import numpy as np
import pytest

from buckler import mbs
from buckler.mbs.laws import KelvinVoigt
from buckler.mbs.progress import TimeUpError, watching
from buckler.mbs.statics import rest as rest_module

BAR, LENGTH, GRAVITY = mbs.Section(0.03, 0.005), 0.3, 9.81
TURNS = np.linspace(-np.pi, np.pi, 17) + 0.05


def pendulum(*turns, loads=(), gravity=GRAVITY):
    """Rigid bars in a row, each drawn at an angle, rad."""
    names, points = "OABC", {"O": (0.0, 0.0)}
    for k, turn in enumerate(turns):
        x, y = points[names[k]]
        points[names[k + 1]] = (x + LENGTH * np.cos(turn), y + LENGTH * np.sin(turn))
    links = [mbs.Link(f"bar{k}", names[k], names[k + 1], mbs.Rigid(BAR)) for k in range(len(turns))]
    joints = [mbs.Revolute(names[k], f"bar{k - 1}" if k else "ground", f"bar{k}") for k in range(len(turns))]
    return mbs.Mechanism(points, links, joints, loads=loads, gravity=(0.0, -gravity))


@pytest.mark.parametrize("turn", TURNS)
def test_a_pendulum_drawn_anywhere_hangs(turn):
    rest = mbs.equilibrium(pendulum(turn))
    assert rest.status == "OK"
    assert rest.stable
    assert rest.point("bar0", "A").position == pytest.approx([0.0, -LENGTH], abs=1e-10)
    assert rest.error < 1e-10


def test_a_pendulum_drawn_upright_stands_unstable():
    rest = mbs.equilibrium(pendulum(np.pi / 2))
    grows = np.sqrt(1.5 * GRAVITY / LENGTH / (1 + (BAR.thickness / LENGTH) ** 2 / 4))
    assert rest.status == "UNSTABLE"
    assert not rest.stable
    assert rest.growth == pytest.approx(grows, rel=1e-9)
    assert "unstable" in rest.message


@pytest.mark.parametrize("stiffness", [1e4, 4.6e5, 1e7])
def test_a_bar_falls_upon_a_stop_however_stiff_and_rests_there(stiffness):
    """Its moment about O: the stop at 0.6 L carries the weight at L/2 and the load at the tip."""
    length, load, section = 0.264, 3.875, mbs.Section(0.0228, 0.00755)
    bar = mbs.Link("bar", "O", "A", mbs.Rigid(section), carries=("M",))
    stop = mbs.Stop("M", at=-2.25e-3, law=KelvinVoigt(stiffness, 1.0), along=(0.0, 1.0))
    rest = mbs.equilibrium(mbs.Mechanism(
        {"O": (0, 0), "A": (length, 0), "M": (0.6 * length, 0)}, [bar], [mbs.Revolute("O", "ground", "bar")], stops=[stop],
        loads=[mbs.Force("A", (0.0, -load))], gravity=(0.0, -GRAVITY),
    ))  # fmt: skip
    depth = (section.mass_per_length * length * GRAVITY / 2 + load) / 0.6 / stiffness
    assert rest.stable
    assert rest.point("bar", "M").position[1] == pytest.approx(-2.25e-3 - depth, rel=1e-9)


@pytest.mark.parametrize("turn", [1.2, 2.5, -1.0])
def test_a_pendulum_slides_along_its_bush_however_long_and_hangs(turn):
    """A stiff contact that bends takes short steps: it is no endless motion."""
    bush = mbs.Clearance("O", "ground", "bar", pin=5e-3, gap=1e-4, law=KelvinVoigt(1e7, 10.0))
    tip = (LENGTH * np.cos(turn), LENGTH * np.sin(turn))
    made = mbs.Mechanism({"O": (0, 0), "A": tip}, [mbs.Link("bar", "O", "A", mbs.Rigid(BAR))], [bush], gravity=(0.0, -GRAVITY))
    rest, sunk = mbs.equilibrium(made), 1e-4 + BAR.mass_per_length * LENGTH * GRAVITY / 1e7
    assert rest.status == "OK"
    assert rest.stable
    assert rest.point("bar", "A").position == pytest.approx([0.0, -LENGTH - sunk], abs=1e-9)


def block(height, stop=True):
    return mbs.Mechanism(
        points={"P": (0, height), "Q": (0, height + 0.1)},
        links=[mbs.Link("block", "P", "Q", mbs.Rigid.of(mass=1.0, inertia=1e-3))],
        joints=[mbs.Slider("P", "block", "ground", along=(0, 1))],
        stops=[mbs.Stop("P", at=0.0, law=KelvinVoigt(1e5, 0.0), along=(0, 1))] if stop else [],
        gravity=(0, -GRAVITY),
    )


@pytest.mark.parametrize(
    ("mechanism", "name"),
    [
        (pendulum(0.4, loads=[mbs.Torque("bar0", 1.0)], gravity=0.0), "bar0"),
        (block(0.05, stop=False), "block"),
        (
            mbs.Mechanism({"A": (0, 0), "B": (0.3, 0)}, [mbs.Link("thrown", "A", "B", mbs.Beam(BAR))], gravity=(0, -GRAVITY)),
            "thrown",
        ),
        (
            mbs.Mechanism(
                {"A": (0, 0), "B": (0.3, 0)}, [mbs.Link("pushed", "A", "B", mbs.Rigid(BAR))], loads=[mbs.Force("A", (1.0, 0.0))]
            ),
            "pushed",
        ),
    ],
    ids=["crank under a torque", "falls past no floor", "thrown strip", "pushed free bar"],
)
def test_what_has_no_equilibrium_is_named(mechanism, name):
    rest = mbs.equilibrium(mechanism)
    assert rest.status == "FREE_MOTION"
    assert f"'{name}'" in rest.message
    assert np.isnan(rest.point(name, mechanism.link(name).start).position).all()
    assert not rest.stable


def test_a_load_beyond_a_limit_point_leads_past_it():
    """Two springs at a mass, von Mises' truss: 2 k (l0/l - 1) y = F; beyond its snap it rests on the other side."""
    stiffness, height, free = 1e4, 0.3, np.hypot(1.0, 0.3)
    top = np.sqrt(free ** (2 / 3) - 1.0)
    snap = 2 * stiffness * (free - np.hypot(1, top)) * top / np.hypot(1, top)
    truss = mbs.Mechanism(
        points={"P": (0, height), "Q": (0, height + 0.1), "A": (-1, 0), "C": (1, 0)},
        links=[mbs.Link("block", "P", "Q", mbs.Rigid.of(mass=1.0, inertia=1e-3))],
        joints=[mbs.Slider("P", "block", "ground", along=(0, 1))],
        loads=[mbs.Spring("P", f"ground:{end}", stiffness=stiffness, free_length=free) for end in "AC"]
        + [mbs.Force("P", (0, -1.1 * snap))],
    )
    rest = mbs.equilibrium(truss)
    y = rest.point("block", "P").position[1]
    assert rest.stable
    assert y < -height
    assert 2 * stiffness * (free / np.hypot(1, y) - 1) * y == pytest.approx(1.1 * snap, rel=1e-9)
    assert "of the load" in rest.message


def hung(*loads):
    """Two blocks on vertical slides, 2 kg and 1.2 kg, on a rope over two pulleys."""
    return mbs.Mechanism(
        {"B": (0.3, -0.5), "C": (0.6, -0.2), "D": (0.6, 0), "E": (0.3, 0), "B2": (0, 0), "C2": (1, 0), "S": (0.3, -0.9)},
        [mbs.Link("one", "B", "B2", mbs.Rigid.of(mass=2.0, inertia=1e-3)), mbs.Link("two", "C", "C2",
        mbs.Rigid.of(mass=1.2, inertia=1e-3))],
        [mbs.Slider("B", "one", "ground", along=(0, 1)), mbs.Slider("C", "two", "ground", along=(0, 1))],
        couplings=[mbs.Rope("one:B", "two:C", over=("ground:E", "ground:D"))], loads=loads, gravity=(0.0, -GRAVITY),
    )  # fmt: skip


def test_a_slack_rope_is_named_at_the_time_limit_too(monkeypatch):
    def run_out_of_time(problem, found, _keeps_degree):
        watching.get().best = problem, found, 0.0, ""
        raise TimeUpError("timeout = 1 s is over")

    monkeypatch.setattr(rest_module, "_refine", run_out_of_time)
    below = mbs.Spring("B", "ground:S", stiffness=1000.0, free_length=0.4)
    assert mbs.equilibrium(hung(below, mbs.Force("C", (0.0, 40.0)))).status == "SLACK"


def test_a_rope_pulls_and_ends_at_its_pulleys():
    below = mbs.Spring("B", "ground:S", stiffness=1000.0, free_length=0.4)
    drawn = mbs.equilibrium(hung())
    assert (drawn.status, drawn.stable) == ("FREE_MOTION", False)
    assert "'rope.one-two' draws one of its ends into a pulley" in drawn.message
    pushed = mbs.equilibrium(hung(below, mbs.Force("C", (0.0, 40.0))))
    assert (pushed.status, pushed.stable) == ("SLACK", False)
    assert f"push with {40.0 - 1.2 * GRAVITY:.4g} N" in pushed.message
    pulled = mbs.equilibrium(hung(below))
    assert pulled.status == "OK"
    assert pulled.point("one", "B").position[1] == pytest.approx(-0.5 - 0.8 * GRAVITY / 1000.0, rel=1e-9)


@pytest.mark.parametrize(("asked", "said"), [({"load": np.nan}, "load"), ({"degree": 2.5}, "degree"), ({"degree": 0}, "degree")])
def test_what_makes_no_sense_is_refused_in_a_line(asked, said):
    with pytest.raises(ValueError, match=f"^{said} = "):
        mbs.equilibrium(pendulum(0.1), **asked)


def test_reactions_are_the_forces_of_a_run_at_rest():
    """A rod on two guides, held by a drive: with the signs of the signals of a run."""
    rod = mbs.Mechanism(
        {"A": (0, 0), "B": (0.3, 0.2)},
        [mbs.Link("rod", "A", "B", mbs.Rigid.of(mass=1.0, inertia=0.01, centre=(0.1, 0)))],
        guides=[mbs.Guide("A", "rod"), mbs.Guide("B", "rod", along=(0, 1))],
        drives=[mbs.Drive("B", 0.0)],
        loads=[mbs.Force("A", (-4.0, 0))],
        gravity=(0, -9.81),
    )
    run, rest = mbs.simulate(rod, 0.05), mbs.equilibrium(rod)
    for signal, name in (("A.guide_force", "guide A"), ("B.guide_force", "guide B"), ("drive.force", "drive")):
        assert rest.reaction(name) == pytest.approx([run[signal][-1]], rel=1e-9)
