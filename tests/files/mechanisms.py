"""Generated mechanisms of the whole grammar: every kind of element, law and function that a file may name."""

from math import pi

from hypothesis import strategies as st

from buckler.mbs import elements, laws
from buckler.mbs.declare import Either, Quantity, Vector, declarations, kinds_of
from buckler.mbs.elements import KINDS, Drive, Guide, Link, Motion, Ramp, Revolute, Rigid, Section
from buckler.mbs.functions import Components, Expression, Table
from buckler.mbs.functions.fields import Function
from buckler.mbs.mechanism import Mechanism

NAMES = st.sampled_from(["crank", "Schwinge", "link 2", "a-b", "κ", 'q"uote'])
LENGTH = st.floats(0.01, 2.0)


def floats(low, high):
    """Floats whose shortest text is what is written."""
    return st.floats(low, high, allow_nan=False, allow_infinity=False)


def sections():
    materials = st.builds(
        elements.Material, floats(1e6, 1e12), floats(1, 2e4), floats(-0.9, 0.45), floats(0, 1e-2), floats(0, 1e-2)
    )
    return st.builds(Section, floats(1e-4, 0.1), floats(1e-5, 0.05), materials) | st.builds(Section, LENGTH, floats(1e-5, 0.05))


def of_time():
    formula = st.sampled_from(["sin(3*t)", "t**2/(1+t)", "0.1*step(t, 0, 0, 1, 2)", "exp(-t)*cos(2*pi*t)", "max(t, 0.3)"])
    columns = st.lists(floats(-9, 9), min_size=2, max_size=5)
    table = st.builds(lambda values, smooth: Table(tuple(range(len(values))), values, smooth), columns, st.booleans())
    return formula.map(Expression) | table


def speeds():
    ramp = st.builds(Ramp, floats(-9, 9), floats(-9, 9), floats(0.1, 9))
    pairs = [("sin(3*t)", "3*cos(3*t)"), ("t**2", "2*t"), ("2*t*exp(-t)", "2*(1-t)*exp(-t)")]
    motion = st.sampled_from(pairs).map(lambda pair: Motion(*map(Expression, pair)))
    return floats(-100, 100) | ramp | motion | st.sampled_from(["1.25*(1-exp(-t/0.2))", "2", "cos(t)"]).map(Expression)


def normal_laws():
    hysteresis = [k for k in vars(laws).values() if isinstance(k, type) and issubclass(k, laws.HysteresisLaw)]
    made = [st.builds(k, floats(1e3, 1e9), floats(0.05, 1), floats(1, 3)) for k in hysteresis if k is not laws.HysteresisLaw]
    made += [st.builds(laws.Hertz, floats(1e3, 1e9)), st.builds(laws.KelvinVoigt, floats(1e3, 1e9), floats(0, 1e3))]
    return st.one_of(*made, st.builds(laws.Impact, floats(1e3, 1e9), floats(0, 1e3), floats(1e-6, 1e-2), floats(1, 3)))


def friction_laws():
    return st.one_of(
        st.builds(laws.NoFriction),
        st.builds(laws.Coulomb, floats(0, 1), floats(1e-5, 1), floats(0, 1)),
        st.builds(laws.AdamsFriction, floats(0.5, 1), floats(0, 0.5)),
        st.builds(laws.Ambrosio, floats(0, 1), floats(0, 0.1), floats(0.2, 1)),
        st.builds(laws.Threlfall, floats(0, 1), floats(1e-4, 1)),
        st.builds(laws.Stribeck, floats(0.5, 1), floats(0, 0.5), floats(1e-4, 1)),
        st.builds(laws.LuGre, floats(0.5, 1), floats(0.1, 0.5), floats(1e-4, 1)),
    )


def bodies():
    inertia = st.builds(Rigid.of, mass=floats(1e-3, 9), inertia=floats(1e-6, 9), centre=st.none() | st.tuples(LENGTH, LENGTH))
    bow = st.sampled_from([Components((Expression("s"), Expression("0.1*sin(pi*s)")))])
    points = st.lists(st.tuples(floats(0, 1), floats(-1, 1)), min_size=3, max_size=5)
    strips = []
    for kind in (elements.Beam, elements.Cable):
        strips.append(st.builds(kind, sections(), elements=st.none() | st.integers(1, 40), imperfection=floats(-0.1, 0.1)))
        strips.append(st.builds(kind, sections(), shape=bow | points))
    modes = st.builds(elements.modal.FreeModes, st.just((1, 2)), st.sampled_from(elements.modal.COUNTINGS))
    modal = st.builds(
        elements.Modal,
        sections(),
        modes,
        floats(0, 0.1) | st.tuples(floats(0, 1), floats(0, 1)),
        st.builds(elements.modal.Box, st.tuples(st.integers(1, 9), st.integers(1, 9), st.integers(1, 9))),
        st.builds(elements.modal.EndFace, floats(1e-9, 1e-3)) | st.builds(elements.modal.PinHole, floats(1e-4, 1)),
    )
    strut = st.builds(elements.Strut, sections(), st.sampled_from(list(declarations(elements.Strut)["load"].spec.named.values())))
    return st.one_of(sections().map(Rigid), inertia, *strips, modal, strut)


@st.composite
def mechanisms(draw):
    """A chain of links, with whatever the kinds of element on this version of Buckler allow."""
    names = draw(st.lists(NAMES, min_size=1, max_size=3, unique=True))
    points = {f"P{k}": (k + draw(floats(0, 0.5)), draw(floats(-1, 1))) for k in range(len(names) + 1)}
    rigid = draw(sections().map(Rigid))
    links = [Link(name, f"P{k}", f"P{k + 1}", rigid if k == 0 else draw(bodies())) for k, name in enumerate(names)]
    joints = []
    for k, name in enumerate(names):
        ends = (f"P{k}", "ground" if k == 0 else names[k - 1], name)
        play = st.builds(lambda pin, gap, law, rub, ends=ends: elements.Clearance(*ends, pin, gap, law, rub),
            floats(1e-4, 0.1), floats(1e-6, 1e-3), normal_laws(), friction_laws())  # fmt: skip
        plain = isinstance(links[k].body, elements.Strut) or (k and isinstance(links[k - 1].body, elements.Strut))
        swapped = (ends[0], ends[2], ends[1])
        more = [kind(*order) for kind in kinds_of(KINDS["joints"]) if kind is not elements.Clearance for order in (ends, swapped)]
        fitting = [st.just(joint) for joint in more if fits(points, links, joints=[joint])]
        joints.append(Revolute(*ends) if plain else draw(st.one_of(*fitting, play)))
    last = names[-1]
    along = st.sampled_from([(1, 0), (3, 4), (1, 1)])
    guides = draw(st.lists(st.builds(Guide, st.just(f"P{len(names)}"), st.just(last), along, floats(0, 9)), max_size=1))
    stops = [elements.Stop(guide.point, draw(floats(5, 9)), draw(normal_laws())) for guide in guides]
    drives = draw(st.lists(st.builds(Drive, st.just(names[0]), speeds()), max_size=1))
    gravity = draw(st.sampled_from([(0, 0), (0, -9.81), (9.81 * 0.5, -pi)]))
    velocities = draw(st.sampled_from([{}, {last: 3.0}, {"P1": (0.1, -2.0)}]))
    more = {
        name: [each for each in draw(others(name, names)) if fits(points, links, **{name: [each]})]
        for name in ("loads", "masses")
    }
    more["couplings"] = [each for each in draw(couplings(names)) if fits(points, links, couplings=[each])]
    return Mechanism(points, links, joints, guides, stops, drives, velocities=velocities, gravity=gravity, **more)


def fits(points, links, **elements):
    """Whether the mechanism takes an element of these links."""
    try:
        Mechanism(points, links, **elements)
    except ValueError:
        return False
    return True


def others(name, links):
    """Loads and masses from their declared fields, whatever kinds there are."""
    whole = (elements.LineLoad,)  # that only a Beam takes: `tests/spectral/test_line_load.py`
    kinds = [generic(kind, links[0], "P1") for kind in kinds_of(KINDS[name]) if kind not in whole]
    return st.lists(st.one_of(*kinds), max_size=2, unique_by=lambda e: e.key) if kinds else st.just([])


def couplings(links):
    """A few between the first link and the second, or the ground."""
    ends = (f"{links[0]}:P1", f"{links[1]}:P2" if len(links) > 1 else "ground:P0")
    made = [
        st.builds(elements.Gear, st.just(ends[0]), st.just(ends[1]), floats(-9, -0.1)),
        st.builds(elements.Rack, st.just(ends[0]), st.just(ends[1]), floats(0.01, 1)),
        st.builds(elements.Belt, st.just(ends[0]), st.just(ends[1]), LENGTH, LENGTH, st.booleans()),
        st.builds(elements.Rope, st.just(ends[0]), st.just("ground:P0"), st.just((ends[1],))),
    ]
    return st.lists(st.one_of(*made), max_size=2, unique_by=lambda e: e.key)


def generic(kind, link, point):
    """Any element by its declared fields: names of a link and a point, positive numbers, functions of time."""
    given = {}
    for name, field in declarations(kind).items():
        forms = field.spec.specs if isinstance(field.spec, Either) else (field.spec,)
        has = {type(form) for form in forms}
        if name in ("link", "first", "second", "follows", "on"):
            given[name] = st.just("ground" if name == "first" else link) if field.required else st.none()
        elif name in ("point", "a", "b"):
            given[name] = st.just("ground:P0" if name == "b" else point)
        elif not field.required and not has & {Quantity, Vector}:
            continue
        elif Vector in has:
            pair = st.tuples(floats(-9, 9), floats(-9, 9))
            given[name] = pair | st.builds(lambda f: Components((f, 1.5)), of_time()) if Function in has else pair
        elif Quantity in has:
            given[name] = floats(0.1, 9) | of_time() if Function in has else floats(0.1, 9)
    return st.builds(kind, **given)
