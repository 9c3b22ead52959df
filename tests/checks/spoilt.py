"""Runs that are right, spoilt by hand by a stated amount, and what the checks say of them."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from simulations import LENGTH, STRIP, G, block, pendulum

from buckler import mbs
from buckler.mbs.checks.suspicions import CHECKS
from buckler.mbs.engine.solve import run_once
from buckler.mbs.laws import Hertz, Stiction
from buckler.mbs.modal import BarModes
from buckler.mbs.record.errors import Errors, Status
from buckler.mbs.record.result import Result
from buckler.mbs.scene.scene import Scene


def held(body, joints, guided=False):
    """A strip of a body under hardly any weight."""
    links, guides = [mbs.Link("s", "A", "B", body)], [mbs.Guide("B", "s")] if guided else []
    return mbs.Mechanism({"A": (0, 0), "B": (LENGTH, 0)}, links, joints, guides, gravity=(0.0, -1e-3))


def turned(mechanism):
    """The same, its link drawn from the other end."""
    (link,) = mechanism.links
    return replace(mechanism, links=[replace(link, start=link.end, end=link.start)])


@cache
def right(kind):
    """A run that is right, and its result."""
    bar = mbs.Rigid(mbs.Section(0.005, 0.020))
    strip, modal = mbs.Beam(STRIP.damped(0.5, LENGTH), elements=4), mbs.Modal(STRIP, BarModes(bending=2, axial=0))
    pin, clamps = [mbs.Revolute("A", "ground", "s")], [mbs.Weld(end, "ground", "s") for end in "AB"]
    made = {
        "fallen": lambda: (block(G, Hertz(1e8)), 0.3),
        "swing": lambda: (pendulum(0.5), 1.0),
        "rocker": lambda: (mbs.crank_rocker(bar, speed=30.0, section=bar.section, angle=0.5), 0.2),
        "strip": lambda: (held(strip, pin), 1.0),
        "clamped": lambda: (held(strip, clamps[:1]), 1.0),
        "column": lambda: (held(strip, pin, guided=True), 0.1),
        "propped": lambda: (held(strip, clamps[:1], guided=True), 0.1),
        "modal": lambda: (held(modal, pin, guided=True), 1.0),
        "modal from its end": lambda: (turned(held(modal, pin, guided=True)), 1.0),
        "built in": lambda: (held(strip, clamps), 1.0),
    }
    mechanism, duration = made[kind]()
    run = run_once(mechanism, duration, mbs.Exudyn(), None, None)
    assert run.failure is None
    return run, Result(Status.OK, "", run.record.time, run.values, run.units, run.work)


CHECK = {check.name: check for check in CHECKS}


def said(name, run, result, **signals):
    """What a check says of a run some of whose signals were replaced."""
    return list(CHECK[name](run, replace(result, signals=result.signals | signals)))


def unbalanced(error, through=1.0, kind="fallen", told=None, **changed):
    """What ENERGY says of a ledger that is off by so much of what was put through, J."""
    run, result = right(kind)
    nothing = np.zeros_like(result.time)
    kept = {"error": nothing + error * through, "throughput": nothing + through, "taken_friction": nothing}
    return said("ENERGY", run, replace(result, energy=kept | changed, error=Errors(0.0, told or {})))


def stretched(strain, step):
    """What ENERGY says of a strip whose axial energy is missing, by steps of so much of the period of its axial vibration."""
    run, result = right("strip")
    time = step * Scene.of(run.record.mechanism).axial_period * np.arange(len(run.record.time))
    stiffness, nothing = STRIP.axial_stiffness, np.zeros_like(time)
    energy = nothing + stiffness * LENGTH * strain**2 / 2
    off = replace(result, energy={"error": energy, "throughput": energy})
    made = replace(run, record=replace(run.record, time=time))
    return said("ENERGY", made, off, **{"s.axial_force": nothing + stiffness * strain})


def bent(way):
    """What ENERGY says of a slider on bristles bent by so much, m, whose energy is missing."""
    push = 2.0
    mechanism = replace(block(0.0, friction=Stiction(0.3, 0.3, 1e-2, 1e3)), gravity=(0.0, -G))
    run = run_once(mechanism, 0.1, mbs.Exudyn(), None, None)
    time = run.record.time
    memory = np.zeros((len(time), 4))
    memory[:, 1] = way
    law = mechanism.guide("A").friction
    normal = push / law.coefficient(np.zeros(1), np.array([way]))
    channels = dict(run.record.channels) | {"guide A": {"reaction": np.full((len(time), 1), normal), "memory": memory}}
    run = replace(run, record=replace(run.record, channels=channels))
    result = Result(Status.OK, "", time, run.values, run.units, run.work)
    energies = {(each.kind, each.name): each.values for each in mechanism.guide("A").energies("guide A", run.record)}
    held = float(energies["stored", "contact"][0])
    assert held == pytest.approx(push * way / 2) and result.signals["A.friction_force"].max() == pytest.approx(push)
    nothing = np.zeros_like(time)
    return said("ENERGY", run, replace(result, energy={"error": nothing + held, "throughput": nothing + held}))


def pressed_strip(shortening, strain, deflection=0.01, kind="strip", lasts=1.0):
    """What UNBUCKLED says of a strip short by a share of its length, of which some is axial strain, that bends by a share."""
    run, result = right(kind)
    nothing = np.zeros_like(result.time)
    signals = {
        "s.end_shortening": nothing + shortening * LENGTH,
        "s.axial_force": nothing - strain * STRIP.axial_stiffness,
        "s.deflection": np.where(result.time > 0, deflection * LENGTH, 0.0),
    }
    return said("UNBUCKLED", run, replace(result, time=lasts * result.time), **signals)


def pressed_by(load, growth, deflection=0.0, kind="column"):
    """The same under so many Euler loads, for as long as the first bending mode at two of them takes to grow by exp(growth)."""
    strain = load * STRIP.euler_load(LENGTH) / STRIP.axial_stiffness
    run_time = right(kind)[1].time[-1]
    return pressed_strip(0.0, strain, deflection, kind, growth / STRIP.first_frequency(LENGTH) / run_time)


def linear(load, deflection, growth, kind="modal"):
    """The same of a modal link between a pin and a guide, that bends by a share of its length."""
    run, result = right(kind)
    still = np.zeros_like(result.time)
    signals = {"A.ground-s.fx": still + load * STRIP.euler_load(LENGTH), "A.ground-s.fy": still}
    signals["s.deflection"] = still + deflection * LENGTH
    lasts = growth / STRIP.first_frequency(LENGTH) / result.time[-1]
    return said("LINEAR", run, replace(result, time=lasts * result.time), **signals)
