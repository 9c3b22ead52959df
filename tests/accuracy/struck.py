"""Contacts, friction and struts, each with its signals by another integrator or a closed form."""

from math import pi, sin, sqrt

import numpy as np
from moved import ROD, G, solved
from scipy.integrate import solve_ivp

from buckler.elastica import law as elastica_law
from buckler.mbs import (
    Drive,
    Guide,
    GuideFriction,
    Link,
    Mechanism,
    Revolute,
    Rigid,
    Section,
    Slider,
    Spring,
    Stop,
    Strut,
    slider_crank,
)
from buckler.mbs.laws import CarvalhoMartins, KelvinVoigt
from buckler.mbs.library import SliderCrank


def strut_slider(section, crank, coupler, mass, speed, duration, contact=lambda x, v: 0.0):
    """Place and speed of a slider that a strut pushes: bent, it is pressed by what bends it."""
    unit, rigidity, euler = section.bending_stiffness / coupler**2, section.axial_stiffness / coupler, section.euler_load(coupler)

    def rates(t, z):
        pin = crank * np.exp(1j * speed * t)
        span = abs(pin - z[0])
        push = rigidity * (coupler - span)
        if push > euler:
            push = euler
            for _ in range(2):
                push = unit * float(elastica_law.fast(1 - span / coupler - push / section.axial_stiffness))
        return [z[1], (push * (z[0] - pin.real) / span + float(contact(*z))) / mass]

    return solved(rates, duration, [float(SliderCrank(crank, coupler).slider(0.0)), 0.0], duration / 2000)


def pressing():
    """A rigid slider-crank that presses its slider into a stop: the depth is a closed form."""
    crank, coupler, speed, k, c = 0.08, 0.3, 12.0, 1e5, 150.0
    kin, turn = SliderCrank(crank, coupler), 2 * pi / 12.0
    at = float(kin.slider(pi)) + 2e-5
    mechanism = slider_crank(Rigid(ROD), law=KelvinVoigt(k, c), mass=0.3, speed=speed, stop=at, lengths=kin)

    def depth(t):
        return at - kin.slider(speed * t)

    def force(t):
        rate = -kin.slider_rate(speed * t) * speed
        return np.where(depth(t) > 0, np.maximum(k * depth(t) + c * rate, 0.0), 0.0)

    force.depth = depth
    return mechanism, turn, {"B.contact_force": force}


def striking_strut():
    """A strut's slider that strikes a stop and buckles."""
    crank, coupler, mass, speed, k, c = 0.14, 0.33, 0.16, 6.0, 1e5, 200.0
    section, kin, duration = Section(0.03, 0.51e-3), SliderCrank(crank, coupler), 2.6 / speed
    at = float(kin.slider(2.2))

    def contact(x, v):
        return np.where(x < at, np.maximum(k * (at - x) - c * v, 0.0), 0.0)

    z = strut_slider(section, crank, coupler, mass, speed, duration, contact)
    mechanism = slider_crank(Strut(section), law=KelvinVoigt(k, c), mass=mass, speed=speed, stop=at, lengths=kin)
    return mechanism, duration, {"B.x": lambda t: z(t)[0], "B.contact_force": lambda t: contact(*z(t))}


def ringing_strut():
    """A strut that begins unstrained rings about its Euler load: both runs damp that away, and its mean."""
    crank, coupler, mass, speed, duration = 0.0391, 0.3355, 0.1634, 12.85, 0.264
    section = Section(0.03, 0.2145e-3)
    z = strut_slider(section, crank, coupler, mass, speed, duration)
    mechanism = slider_crank(Strut(section), law=None, mass=mass, speed=speed, lengths=SliderCrank(crank, coupler))
    return mechanism, duration, {"B.x": lambda t: z(t)[0]}


def hopping():
    """A block let go a third of a thousandth of a millimetre above a stiff stop: it hops 65 times, no higher than it sinks in."""
    m, k, gap, duration = 1.0, 1e9, 3e-7, 0.02
    z = solved(lambda _t, z: [z[1], -G + k * max(-z[0], 0.0) / m], duration, [gap, 0.0], sqrt(m / k) / 12)
    mechanism = Mechanism(
        {"P": (0, gap), "Q": (0, gap + 0.1)}, [Link("b", "P", "Q", Rigid.of(mass=m, inertia=1e-3))],
        [Slider("P", "b", "ground", along=(0, 1))], stops=[Stop("P", at=0.0, law=KelvinVoigt(k, 0.0), along=(0, 1))],
        gravity=(0, -G),
    )  # fmt: skip
    return mechanism, duration, {"P.y": lambda t: z(t)[0], "P.contact_force": lambda t: k * np.maximum(-z(t)[0], 0.0)}


def graze():
    """A pendulum that touches a stop by a thousandth of a millimetre where it turns round."""
    length, start, k, c = 0.3, 1.0, 1e5, 0.0
    m = ROD.mass_per_length * length
    inertia = m * (length**2 + ROD.thickness**2) / 12 + m * length**2 / 4
    duration = 2.2 * 2 * pi * sqrt(inertia / (m * G * length / 2))
    face = -(length * sin(start) - 1e-6)

    def contact(angle):
        return k * np.maximum(face - length * np.sin(angle), 0.0)

    z = solved(
        lambda _t, z: [z[1], (-m * G * length / 2 * sin(z[0]) + contact(z[0]) * length * np.cos(z[0])) / inertia],
        duration, [start, 0.0], 5e-4,
    )  # fmt: skip
    mechanism = Mechanism(
        {"O": (0, 0), "T": (length * sin(start), -length * np.cos(start))}, [Link("rod", "O", "T", Rigid(ROD))],
        [Revolute("O", "ground", "rod")], stops=[Stop("T", at=face, law=KelvinVoigt(k, c), along=(1, 0))], gravity=(0, -G),
    )  # fmt: skip
    return mechanism, duration, {"T.x": lambda t: length * np.sin(z(t)[0]), "T.contact_force": lambda t: contact(z(t)[0])}


def bounces():
    """A block that bounces ever more slowly: its law scales with the speed of each approach, to a hundredth of the first."""
    drop, m = 0.1, 0.5
    contact = CarvalhoMartins(1e7, 0.4)
    duration, times, depths = 0.42, [], []
    begin, state, onset = 0.0, [-drop, 0.0], 1.0
    touch, leave = (lambda _t, z, sign=sign: z[0] if sign > 0 else z[0] + 1e-15 for sign in (1, -1))
    for event, direction in ((touch, 1.0), (leave, -1.0)):
        event.terminal, event.direction = True, direction
    free = True
    while begin < duration:

        def rates(_t, z, free=free, onset=onset):
            return [z[1], G - (0.0 if free or z[0] <= 0 else contact.force(z[0], z[1], onset) / m)]

        part = solve_ivp(rates, (begin, duration), state, "DOP853", dense_output=True, events=touch if free else leave,
                         rtol=1e-11, atol=1e-15, max_step=2e-3 if free else 2e-5)  # fmt: skip
        times.append(part.t[-1])
        depths.append(part.sol)
        begin, state = float(part.t[-1]), part.y[:, -1]
        state[0], free, onset = 0.0, not free, state[1]

    def depth(t):
        which = np.minimum(np.searchsorted(times, t), len(times) - 1)
        return np.array([depths[k](each)[0] for k, each in zip(which, t, strict=True)])

    mechanism = Mechanism(
        {"A": (0, 0), "B": (0.1, 0)}, [Link("bar", "A", "B", Rigid.of(mass=m, inertia=1e-3))],
        [Slider("A", "bar", "ground", along=(1, 0))], stops=[Stop("A", at=drop, law=contact, along=(1, 0))], gravity=(G, 0),
    )  # fmt: skip
    return mechanism, duration, {"A.x": lambda t: depth(t) + drop}


def stick_slip():
    """A block drawn by a stiff spring over friction that falls with speed: its force rings, and means of it showed nothing."""
    m, k, speed, friction = 0.5, 2e5, 0.05, GuideFriction(2.0, 4.0, stribeck=2e-2)
    z = solved(
        lambda t, z: [z[1], (k * (speed * t - z[0]) - float(friction.force(np.array([z[1]]))[0])) / m], 0.2, [0.0, 0.0], 1e-4
    )
    feather = Rigid.of(mass=1e-3, inertia=1e-6)
    mechanism = Mechanism(
        {"A": (0, 0), "B": (0.1, 0), "C": (0.3, 0), "D": (0.4, 0)},
        [Link("block", "A", "B", Rigid.of(mass=m, inertia=1e-3)), Link("hand", "C", "D", feather)],
        guides=[Guide("A", "block", friction=friction), Guide("B", "block"), Guide("C", "hand"), Guide("D", "hand")],
        drives=[Drive("C", speed)],
        loads=[Spring("block:B", "hand:C", stiffness=k, free_length=0.2)],
    )  # fmt: skip
    spring = next(name for name in mechanism.elements() if "spring" in name)
    return mechanism, 0.2, {"A.x": lambda t: z(t)[0], f"{spring}.force": lambda t: k * (speed * t - z(t)[0])}
