"""Stops anywhere: any point of a link against a line of the ground or of a link, with momentum, energy, restitution."""

import math
from dataclasses import replace

import numpy as np
import pytest
from jointed import turned
from simulations import fine

from buckler import mbs
from buckler.mbs.engine.forces import FreeContact
from buckler.mbs.laws import CarvalhoMartins, Coulomb, ExactRestitution, KelvinVoigt, LuGre

G = 9.81
BAR = mbs.Section(0.020, 0.010)
ROD = mbs.Rigid.of(mass=0.8, inertia=0.02, centre=(0.25, 0.0))
LAW = ExactRestitution(1e11, 0.6)


def falling(law=LAW, angle=0.0, body=ROD, drop=0.05, side=1, stops=None, tilt=0.0):
    """A free rod that falls with its end B towards a face `drop` below it; the whole scene turned by an angle."""
    a, b = turned(tilt, (-0.25, 0.0), (0.25, 0.0))
    a, b, down = turned(angle, a, b, (0.0, -1.0))
    across = tuple(side * c for c in down)
    at = float(np.dot(across, b)) + side * drop
    return mbs.Mechanism(
        points={"A": a, "B": b},
        links=[mbs.Link("rod", "A", "B", body)],
        stops=stops or [mbs.Stop("B", at=at, law=law, along=across)],
        gravity=(G * down[0], G * down[1]),
    )


def once(drop):
    return math.sqrt(2 * drop / G)


@pytest.mark.parametrize(("angle", "side"), [(0.0, 1), (0.7, 1), (2.5, -1)])
def test_end_of_a_free_rod_rebounds_by_the_law(angle, side):
    """An impulse P at arm r: the point's speed -e v, P = (1 + e) v/(1/m + r^2/J), spin P r/J, centre's speed v - P/m."""
    drop, e, arm = 0.05, 0.6, 0.25
    v = math.sqrt(2 * G * drop)
    duration = once(drop) + 0.01
    result = fine(
        mbs.simulate(
            falling(angle=angle, side=side),
            duration,
            solver=mbs.Exudyn(mbs.Controlled(tolerance=1e-7, contact_resolution=160)),
            ledger=True,
        )
    )
    run = result.signals
    impulse = np.trapezoid(run["B.contact_force"], result.time)
    assert impulse == pytest.approx((1 + e) * v / (1 / 0.8 + arm**2 / 0.02), rel=3e-3)
    place = turned(-angle, *zip(run["rod.vx"], run["rod.vy"], strict=True))
    speed_down = -place[-1][1]
    assert speed_down == pytest.approx(G * duration - impulse / 0.8, rel=1e-5)
    spin = (run["B.vx"] - run["A.vx"])[-1], (run["B.vy"] - run["A.vy"])[-1]
    chord = (run["B.x"] - run["A.x"])[-1], (run["B.y"] - run["A.y"])[-1]
    omega = (chord[0] * spin[1] - chord[1] * spin[0]) / 0.25
    assert omega == pytest.approx(impulse * arm / 0.02, rel=2e-3)
    assert result.energy_balance < 1e-4


def striking(second):
    """A scene of two links, one with a face."""
    bodies = {"rigid": (ROD, ROD), "beam": (mbs.Beam(BAR, 2), mbs.Beam(BAR, 2)), "cable": (mbs.Cable(BAR, 2), mbs.Cable(BAR, 2)),
              "beam on rigid": (mbs.Beam(BAR, 2), ROD)}[second]  # fmt: skip
    on = "face:M" if second in ("beam", "cable") else "face"
    carries = ({"S": 0.5}, {"M": 0.5})
    points = {"A": (0, 0), "B": (0.5, 0.1), "C": (0.1, -0.3), "D": (0.7, -0.2), "S": (0.25, 0.05), "M": (0.4, -0.25)}
    links = [mbs.Link("rod", "A", "B", bodies[0], carries[0]), mbs.Link("face", "C", "D", bodies[1], carries[1])]
    along = (0.3, -1.0)
    unit = np.array(along) / np.hypot(*along)
    stop = mbs.Stop("S", at=float(unit @ points["S"]) + 0.01, law=CarvalhoMartins(1e5, 0.5, 1.0), along=along, on=on)
    return mbs.Mechanism(points, links, stops=[stop])


@pytest.mark.parametrize("second", ["rigid", "beam", "cable", "beam on rigid"])
def test_forces_do_the_work_of_the_depth_and_leave_momentum_alone(second):
    rng = np.random.default_rng(5)
    scene = mbs.build(striking(second))
    (contact,) = scene.stops.values()
    assert isinstance(contact, FreeContact)
    size = len(contact.columns)
    touched = 0
    for _ in range(50):
        q, v = rng.normal(0, 0.05, size), rng.normal(0, 1, size)
        contact.onset_speed = 0.5
        depth, rate, slope = contact.differentiate_depth(q, v)
        h = 1e-6
        for k in range(size):
            step = np.eye(size)[k] * h
            rise = (contact.differentiate_depth(q + step, v)[0] - contact.differentiate_depth(q - step, v)[0]) / (2 * h)
            assert slope[k] == pytest.approx(rise, abs=1e-8)
        assert rate == pytest.approx(np.dot(slope, v), abs=1e-12)
        force = np.array(contact.forces(None, 0.0, 0, q, v))
        f = contact.force(depth, rate)
        assert force @ v == pytest.approx(-f * rate, abs=1e-12 * max(1, f))
        k = contact.first.size
        assert force[:2] + force[k : k + 2] == pytest.approx([0, 0], abs=1e-12 * max(1, f))
        assert force[:2] == pytest.approx(-f * np.array(slope[:2]), abs=1e-12 * max(1, f))
        moments = []
        for end, at in ((contact.first, 0), (contact.second, k)):
            x, y = end.place + q[at : at + 2]
            moments.append(x * force[at + 1] - y * force[at] + (force[at + 2] if end.size == 3 else 0.0))
        assert sum(moments) == pytest.approx(0.0, abs=1e-12 * max(1, f))
        touched += f > 0
    assert touched > 4


def test_face_of_a_falling_link_takes_the_blow_and_momentum_stays():
    """A free rod falls on a free table that lies on the ground: what the ground did not give, they share."""
    rod = mbs.Rigid.of(mass=0.8, inertia=0.02, centre=(0.25, 0.0))
    table = mbs.Rigid.of(mass=2.0, inertia=0.05, centre=(0.3, 0.0))
    mechanism = mbs.Mechanism(
        points={"A": (-0.25, 0.2), "B": (0.25, 0.2), "C": (-0.3, 0), "D": (0.3, 0), "E": (0.25, 0.0), "W": (-0.25, 0)},
        links=[mbs.Link("rod", "A", "B", rod), mbs.Link("table", "C", "D", table, carries=["E"])],
        stops=[
            mbs.Stop("B", at=0.1, law=ExactRestitution(1e6, 0.8), along=(0, 1), on="table"),
            mbs.Stop("C", at=-0.01, law=ExactRestitution(1e6, 0.7), along=(0, 1)),
            mbs.Stop("D", at=-0.02, law=ExactRestitution(1e6, 0.7), along=(0, 1)),
        ],
        gravity=(0, -G),
    )
    result = fine(
        mbs.simulate(mechanism, 0.3, solver=mbs.Exudyn(mbs.Controlled(tolerance=1e-7, contact_resolution=100)), ledger=True)
    )
    run, t = result.signals, result.time
    blows = {name: np.concatenate([[0], np.cumsum(np.diff(t) * (f[1:] + f[:-1]) / 2)]) for name, f in
             ((n, run[f"{n}.contact_force"]) for n in "BCD")}  # fmt: skip
    assert blows["B"][-1] > 0.1
    momentum = 0.8 * run["rod.vy"] + 2.0 * run["table.vy"]
    outside = blows["C"] + blows["D"] - 2.8 * G * t
    assert momentum == pytest.approx(outside, abs=3e-3 * np.abs(momentum).max())
    assert 0.8 * run["rod.vy"] + 0.8 * G * t == pytest.approx(blows["B"], abs=3e-3 * blows["B"][-1])
    assert result.energy_balance < 1e-3


@pytest.mark.parametrize(
    "body", [mbs.Beam(mbs.Section(0.02, 0.002), 4), mbs.Cable(mbs.Section(0.02, 0.002), 4)], ids=["beam", "cable"]
)
def test_middle_of_a_beam_rests_on_a_stop(body):
    """A pinned strip sags onto a stop below its middle: 5/8 of its weight for the whole sag, at rest."""
    section = body.section.damped(0.3, 0.5)
    strip = replace(body, section=section)
    load = section.mass_per_length * G
    sag = 5 * load * 0.5**4 / (384 * section.bending_stiffness)
    stiffness = 1e6
    mechanism = mbs.Mechanism(
        points={"A": (0, 0), "B": (0.5, 0), "M": (0.25, 0)},
        links=[mbs.Link("strip", "A", "B", strip, {"M": 0.5})],
        joints=[mbs.Revolute("A", "ground", "strip")],
        guides=[mbs.Guide("B", "strip")],
        stops=[mbs.Stop("M", at=-0.5 * sag, law=KelvinVoigt(stiffness, 100.0), along=(0, 1))],
        gravity=(0, -G),
    )
    result = fine(mbs.simulate(mechanism, 3.0, ledger=True))
    force = result.signals["M.contact_force"][-1]
    whole = 5 / 8 * load * 0.5
    assert force == pytest.approx(0.5 * whole, rel=5e-3)
    assert result.energy_balance < 1e-2


SOLVERS = {
    "compiled": mbs.Spectral(mbs.Controlled(tolerance=1e-7)),
    "engine": mbs.Exudyn(mbs.Controlled(tolerance=1e-7)),
}


def thrown(tilt=0.0, on="ground", speed=1.0, friction=0.3):
    """A block thrown along a rough face, of the ground or of a cart of twice its mass; the whole scene turned, gravity not."""
    points = dict(zip("ABCD", turned(tilt, (0.0, 0.0), (0.1, 0.0), (-0.2, -0.05), (0.5, -0.05)), strict=True))
    links = [mbs.Link("block", "A", "B", mbs.Rigid.of(mass=0.5, inertia=1e-3, centre=(0.05, 0.0)))]
    if on == "cart":
        links += [mbs.Link("cart", "C", "D", mbs.Rigid.of(mass=1.0, inertia=0.1, centre=(0.35, 0.0)))]
    line, across = turned(tilt, (1.0, 0.0), (0.0, 1.0))
    face = dict(at=-1e-8, law=KelvinVoigt(1e6, 300.0), along=across, on=on, friction=Coulomb(friction, 1e-4))
    velocity = tuple(speed * c for c in line)
    return mbs.Mechanism(
        points, links, stops=[mbs.Stop(point, **face) for point in "AB"], velocities={"A": velocity, "B": velocity},
        guides=[mbs.Guide(point, "cart", along=line) for point in "CD"] if on == "cart" else [], gravity=(0.0, -G),
    )  # fmt: skip


@pytest.mark.parametrize("solver", SOLVERS.values(), ids=SOLVERS.keys())
@pytest.mark.parametrize("tilt", [0.0, 0.2, -0.5])
def test_block_on_a_rough_slope_slides_by_coulomb(tilt, solver):
    """It loses g (mu cos + sin) of its speed a second; friction takes mu m g cos of each metre."""
    mu, duration = 0.3, 0.2
    result = fine(mbs.simulate(thrown(tilt), duration, solver=solver, ledger=True))
    run = result.signals
    slowing = G * (mu * math.cos(tilt) + math.sin(tilt))
    way = np.hypot(run["A.x"], run["A.y"])[-1]
    assert way == pytest.approx(duration - slowing * duration**2 / 2, rel=1e-4)
    assert run["A.sliding_speed"][-1] == pytest.approx(-(1 - slowing * duration), rel=1e-4)  # to the left of the face's direction
    drag = run["A.friction_force"] + run["B.friction_force"]
    assert drag[-1] == pytest.approx(-mu * 0.5 * G * math.cos(tilt), rel=1e-4)
    assert result.energy["taken_friction"][-1] == pytest.approx(-drag[-1] * way, rel=1e-4)
    assert result.energy_balance < 1e-4


@pytest.mark.parametrize("solver", SOLVERS.values(), ids=SOLVERS.keys())
def test_block_takes_its_rough_cart_along(solver):
    """Friction ends the sliding, not the motion: speeds meet at a third, momentum stays, the reduced mass's energy is gone."""
    result = fine(mbs.simulate(thrown(on="cart"), 0.4, solver=solver, ledger=True))
    run = result.signals
    assert [run["A.vx"][-1], run["C.vx"][-1]] == pytest.approx([1 / 3, 1 / 3], rel=1e-6)
    assert result.energy["taken_friction"][-1] == pytest.approx(0.5 * (0.5 * 1.0 / 1.5), rel=1e-4)
    assert result.energy_balance < 1e-4
    still = abs(run["A.sliding_speed"]) < 1e-3
    meet = 1.0 / (0.3 * G * (1 + 0.5))  # the block is slowed by mu g, the cart driven by half of it
    assert result.time[still].min() == pytest.approx(meet, rel=2e-2)


@pytest.mark.parametrize("kind", [mbs.Spectral, mbs.Exudyn])
def test_driven_crank_scrapes_a_rough_face(kind):
    """Friction takes mu times the integral of k d |v_x| dt, with d = r sin(w t) - h, v_x = -r w sin(w t)."""
    r, w, h, k, mu = 0.1, 5.0, 0.0995, 1e5, 0.4
    mechanism = mbs.Mechanism(
        {"O": (0, 0), "A": (r, 0)},
        [mbs.Link("crank", "O", "A", mbs.Rigid.of(mass=0.2, inertia=1e-3, centre=(r / 2, 0)))],
        [mbs.Revolute("O", "ground", "crank")],
        stops=[mbs.Stop("A", at=h, law=KelvinVoigt(k, 0.0), along=(0, 1), friction=Coulomb(mu))],
        drives=[mbs.Drive("crank", w)],
    )
    result = fine(mbs.simulate(mechanism, 0.6, solver=kind(mbs.Controlled(tolerance=1e-8)), ledger=True))
    t = np.linspace(0, 0.6, 200001)
    rubbed = mu * np.trapezoid(k * np.maximum(r * np.sin(w * t) - h, 0) * abs(r * w * np.sin(w * t)), t)
    assert result.energy["taken_friction"][-1] == pytest.approx(rubbed, rel=1e-3)
    assert result.energy_balance < 1e-4


WRONG = {
    "no direction": (dict(at=1.0), "stop at 'B': along: must be given"),
    "on itself": (dict(at=1.0, along=(1, 0), on="rod"), "must be another body"),
    "on a stranger": (dict(at=1.0, along=(1, 0), on="arm"), "on: unknown link 'arm'"),
    "on a beam, anywhere": (dict(at=1.0, along=(1, 0), on="beam"), "give a point, as 'link:point'"),
    "out of the beam's reach": (dict(at=1.0, along=(1, 0), on="beam:A"), "'beam' does not reach"),
    "of another link": (dict(at=1.0, along=(1, 0), link="strut"), "does not reach"),
    "rough in a guide": (dict(at=2.0, friction=Coulomb(0.1)), "give it to the guide, or give `along`"),
    "of a law with a bristle": (dict(at=2.0, along=(1, 0), friction=LuGre(0.3, 0.2, 0.01)), "a face keeps no bristle"),
    "no length": (dict(at=1.0, along=(0, 0)), r"stop at 'B': along"),
}


@pytest.mark.parametrize(("given", "message"), WRONG.values(), ids=WRONG.keys())
def test_stop_that_cannot_be_is_refused(given, message):
    points = {"A": (0, 0), "B": (1, 0), "C": (1, 1), "D": (2, 2)}
    links = [
        mbs.Link("rod", "A", "B", ROD),
        mbs.Link("beam", "C", "D", mbs.Beam(BAR)),
        mbs.Link("strut", "A", "D", mbs.Strut(BAR)),
    ]
    with pytest.raises(ValueError, match=message):
        mbs.Mechanism(
            points, links, stops=[mbs.Stop("B", law=LAW, **given)], guides=[mbs.Guide("B", "rod")] * ("friction" in given)
        )


@pytest.mark.parametrize("off", [0.0, 1e-16, -1e-16, 1e-11, -1e-11])
def test_point_on_the_face_is_refused_whichever_way_rounding_goes(off):
    with pytest.raises(ValueError, match="is where the point starts, to rounding"):
        mbs.build(falling(stops=[mbs.Stop("B", at=0.25 + off, law=LAW, along=(1, 0))]))


def test_a_stop_that_nothing_reaches_says_how_near_it_came():
    """A rod that falls 5 mm of the 50 mm to its stop."""
    mechanism = falling(drop=0.05)
    notes = mbs.simulate(mechanism, once(0.005)).provenance["notes"]
    assert any("never reached its stop; it came within 0.045 m" in note for note in notes), notes
