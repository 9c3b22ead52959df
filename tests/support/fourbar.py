"""The crank-rocker as numbers: its ideal motion in closed form, and runs of it on the compiled solver from any state.

Coordinates are crank x, y | coupler x, y, theta | rocker x, y, theta | the rocker's modes: centres of mass in the plane and
directions of the bars, m and rad. Second indices: joints O, A, B, C.
"""

from dataclasses import dataclass, field, replace
from math import inf, pi
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Clearance, Controlled, Material, Mechanism, Modal, Rigid, Section, Spectral, Status, crank_rocker
from buckler.mbs.laws import AdamsFriction
from buckler.mbs.library import RATTLING, CrankRocker
from buckler.mbs.record.lookup import hermite
from buckler.mbs.record.run import ledger as energies
from buckler.mbs.spectral.dense import at_times
from buckler.mbs.spectral.output import Output
from buckler.mbs.spectral.recording import follow_markers, record_of
from buckler.mbs.spectral.run import RunState, integrate
from buckler.mbs.spectral.scene import CompiledScene
from buckler.mbs.spectral.tables import STEP_START, Report

JOINTS = "OABC"


class IdealMotion(NamedTuple):
    """Crank, coupler and rocker: centres x, y and direction theta, each (..., 3, 3). The rocker points from C to B."""

    place: Any
    velocity: Any
    acceleration: Any


@dataclass(frozen=True)
class FourBar:
    """O = (0, 0), C = (frame, 0); a clearance of 0 makes a joint ideal, inf leaves it out."""

    crank: float = 0.105
    coupler: float = 0.272
    rocker: float = 0.175
    frame: float = 0.225
    width: float = 0.005
    thickness: float = 0.020
    density: float = 7850.0
    speed: float = 10 * pi
    start: float = 0.0
    pin: float = 5e-3
    gap: Any = 0.25e-3
    law: Any = RATTLING
    friction: Any = field(default_factory=lambda: AdamsFriction(static=0.3, dynamic=0.1))
    turned: str = ""
    gravity: tuple[float, float] = (0.0, 0.0)
    modes: Modal | None = None

    @property
    def gaps(self):
        return tuple(self.gap) if isinstance(self.gap, tuple | list) else (self.gap,) * 4

    @property
    def lengths(self):
        return np.array([self.crank, self.coupler, self.rocker])

    @property
    def masses(self):
        masses = self.density * self.width * self.thickness * self.lengths
        if self.modes is not None:
            masses[2] = self.modes.planar(self.rocker).mass
        return masses

    @property
    def inertias(self):
        inertias = self.masses * (self.lengths**2 + self.thickness**2) / 12
        if self.modes is not None:
            inertias[2] = self.modes.planar(self.rocker).inertia
        return inertias

    @property
    def section(self):
        return Section(self.width, self.thickness, Material(modulus=207e9, density=self.density, poisson=0.29))

    @property
    def period(self):
        return 2 * pi / abs(self.speed) if self.speed else inf

    def mechanism(self, rocker: Any = None) -> Mechanism:
        """With another body of the rocker, if one is given."""
        gaps = dict(zip(JOINTS, self.gaps, strict=True))

        def play(point, first, second):
            pair = (second, first) if point in self.turned else (first, second)
            return Clearance(point, *pair, self.pin, gaps[point], self.law, self.friction)

        made = crank_rocker(
            rocker or self.modes or Rigid(self.section), speed=self.speed, play=play, section=self.section, angle=self.start,
            with_play="".join(point for point, gap in gaps.items() if 0 < gap < inf),
            lengths=CrankRocker(self.crank, self.coupler, self.rocker, self.frame),
        )  # fmt: skip
        return replace(made, gravity=self.gravity, joints=[j for j in made.joints if gaps[j.point] < inf])

    def ideal(self, t: Any) -> IdealMotion:
        """Loop closure in closed form, in complex numbers; B on the left of A-C."""
        angle = self.start + self.speed * np.asarray(t, dtype=float)
        a = self.crank * np.exp(1j * angle)
        chord = self.frame - a
        d = np.abs(chord)
        corner = np.arccos((self.coupler**2 + d**2 - self.rocker**2) / (2 * self.coupler * d))
        b = self.coupler * np.exp(1j * (np.angle(chord) + corner))
        c = chord - b
        w = self.speed
        # i (wb b + wc c) = -i w a, then b and c for the angular accelerations
        cross = _cross(b, c)
        wb, wc = -w * _cross(a, c) / cross, w * _cross(a, b) / cross
        rest = w**2 * a + wb**2 * b + wc**2 * c
        tb, tc = _cross(1j * c, rest) / -cross, _cross(1j * b, rest) / cross
        end, speed, change = np.zeros((3, *a.shape), dtype=complex)  # of the bar's first end
        found = []
        for bar, direction, spin, turn in ((a, angle, w, 0.0), (b, np.angle(b), wb, tb), (c, np.angle(-c), wc, tc)):
            flow, rush = 1j * spin * bar, (1j * turn - spin**2) * bar
            middles = (end + bar / 2, speed + flow / 2, change + rush / 2)
            found.append([_planar(z, x) for z, x in zip(middles, (direction, spin, turn), strict=True)])
            end, speed, change = end + bar, speed + flow, change + rush
        return IdealMotion(*(np.stack(parts, axis=-2) for parts in zip(*found, strict=True)))


def _planar(z, angle):
    return np.stack([z.real, z.imag, np.broadcast_to(angle, z.shape)], axis=-1)


def _cross(a, b):
    return (np.conj(a) * b).imag


def ideal_state(bar, t=0.0):
    """Coordinates and velocities of the ideal mechanism, journals centred, rocker undeformed; shape (2 n,)."""
    place, velocity, _ = bar.ideal(t)
    still = np.zeros(0 if bar.modes is None else len(bar.modes.planar(bar.rocker)))
    return np.concatenate([place[0, :2], place[1], place[2], still, velocity[0, :2], velocity[1], velocity[2], still])


class Model(NamedTuple):
    """The crank-rocker as the solver has it, and its columns of the coordinates above."""

    bar: FourBar
    scene: CompiledScene
    columns: Any

    @classmethod
    def of(cls, bar):
        scene = CompiledScene.of(bar.mechanism())
        return cls(bar, scene, np.array([0, 1, *range(3, scene.size)]))

    def state(self, values, t=0.0):
        n = len(self.columns)
        q, v = np.zeros(n + 1), np.zeros(n + 1)
        q[self.columns], v[self.columns] = values[:n], values[n:]
        q[2], v[2] = self.bar.start + self.bar.speed * t, self.bar.speed
        return RunState(t, q, v, self.scene.memory())

    def joints(self, reports, lam):
        """On the first body of each joint the force, N, (times, 4, 2); normal force, depth, its rate, sliding, (times, 4)."""
        force, found = np.zeros((len(reports), 4, 2)), np.zeros((4, len(reports), 4))
        found[1] = -np.array(self.bar.gaps)
        for j, joint in enumerate(JOINTS):
            for k in (k for k, name in enumerate(self.scene.force_names) if name[0] == joint):
                push, drag, *found[1:4, :, j], _, nx, ny = reports[:, k].T
                side = -1.0 if joint in self.bar.turned else 1.0
                force[:, j] = -side * np.stack([push * nx - drag * ny, push * ny + drag * nx], axis=1)
                found[0, :, j] = push
            if rows := [r for r, name in enumerate(self.scene.row_names) if name.partition(".")[0] == joint]:
                force[:, j] = -lam[:, rows]
        return SimpleNamespace(force=force, **dict(zip(("normal", "depth", "rate", "sliding"), found, strict=True)))


BOOLE = np.array([7.0, 32.0, 12.0, 32.0, 7.0]) / 90.0


def reports_at(scene, seen):
    """Reports of forces at states, whose bristles are as they stand, (times, forces, 8)."""
    memory = seen.memory.copy()
    memory[:, :, STEP_START] = seen.time[:, None]
    reports = np.empty((len(seen.time), len(scene.tables.forces), 8))
    follow_markers(scene, seen._replace(memory=memory), [], reports)
    return reports


def powers(scene, seen, reports, speed):
    """Power on the contact of each force, in its friction, of each constraint's motion, and lost in modes, (times, columns)."""
    push, drag = reports[:, :, Report.VALUE], reports[:, :, Report.FRICTION]
    given = np.where(scene.tables.rows[:, 1] >= 0, -seen.lam * speed, 0.0)
    lost = np.zeros((len(seen.time), 1))
    for first, modes, at in scene.tables.modal:
        damping = scene.tables.data[at + 2 * modes + 2 * modes**2 :][:modes]
        lost[:, 0] += seen.v[:, first + 3 : first + 3 + modes] ** 2 @ damping
    return np.hstack([push * reports[:, :, Report.RATE], drag * reports[:, :, Report.SLIP], given, lost])


def ledger(scene, out, speed):
    """Reports of forces at the ends of steps, powers there, their integrals by Boole's rule, and largest forces and depths."""
    steps = np.diff(out.time)
    seen = at_times(scene, out, np.append(out.time[:-1, None] + steps[:, None] * np.arange(4) / 4, out.time[-1]))
    reports = reports_at(scene, seen)
    power, step = powers(scene, seen, reports, speed), 4 * np.arange(len(steps))[:, None] + np.arange(5)
    push, drag, depth = (reports[:, :, column] for column in (Report.VALUE, Report.FRICTION, Report.LENGTH))
    sizes = np.maximum(0.0, np.hstack([np.hypot(push, drag), depth]))
    work = np.cumsum(steps[:, None] * np.einsum("p,spc->sc", BOOLE, power[step]), axis=0)
    top = np.vstack([sizes[:1], sizes[step].max(axis=1)])
    return reports[::4], power[::4], np.vstack([np.zeros((1, power.shape[1])), work]), top


def run(bar, duration, *, tolerance=1e-8, samples=1001, state=None, longest=inf, most=20_000_000):
    """From t = 0, or rather from a state, with equidistant samples."""
    model = Model.of(bar)
    scene, step = model.scene, min(longest, bar.period / 100)
    method = "chosen" if tolerance >= 1e-6 and longest == inf else "explicit"
    steps = Spectral(Controlled(tolerance, max_step=None if step == inf else step, max_steps=most), method=method)
    begin = model.state(ideal_state(bar) if state is None else np.array(state, dtype=float))
    out, failure, counts = integrate(scene, duration, steps, state=begin)
    times = np.linspace(0.0, duration, samples)
    at = at_times(scene, out, times[times <= out.time[-1] * (1 + 1e-12)])
    here, (reports, power, work, top) = model.joints(reports_at(scene, at), at.lam), ledger(scene, out, bar.speed)
    work = hermite(out.time, work, power, at.time)[0]
    ends, count = model.joints(reports, out.lam), len(scene.force_names)
    loose = {k: JOINTS.index(name[0]) for k, name in enumerate(scene.force_names)}
    peak_force, peak_depth = np.linalg.norm(ends.force, axis=2), np.zeros((len(out.time), 4))
    contact, friction = np.zeros((2, len(at.time), 4))
    for k, j in loose.items():
        peak_force[:, j], peak_depth[:, j] = top[:, k], top[:, count + k]
        contact[:, j], friction[:, j] = work[:, [k, count + k]].T
    seen = []
    for stepped, own in ((peak_force, np.linalg.norm(here.force, axis=2)), (peak_depth, np.maximum(here.depth, 0.0))):
        kept = out.time <= at.time[-1]
        np.maximum.at(own, np.searchsorted(at.time, out.time[kept]), stepped[kept])  # largest since the sample before
        seen.append(own)
    record = record_of(scene, Output(at.time, at.q, at.v, at.a, at.lam, np.tile(scene.memory(), (len(at.time), 1, 1))))
    with np.errstate(all="ignore"):  # a law may be broken
        held = energies(record)
    held = {name: held.get(name, np.zeros(len(at.time))) for name in ("kinetic", "strain", "weight")}
    lent = np.where(np.array(bar.gaps) > 0, bar.law.potential(np.maximum(here.depth, 0.0)), 0.0)
    lent[~np.isfinite(lent)] = 0.0
    taken = {"taken_contact": contact - lent + lent[0], "taken_friction": friction, "taken_modes": work[:, -1]}
    whole = sum(held.values()) + lent.sum(axis=1)
    lost = taken["taken_contact"].sum(axis=1) + friction.sum(axis=1) + taken["taken_modes"]
    given = work[:, 2 * count + scene.row_names.index("drive")]
    off = np.abs(whole - whole[0] + lost - given).max() / max((whole - held["weight"].min() + lost).max(), 1e-300)
    begun = np.argwhere((ends.depth[:-1] <= 1e-12) & (ends.depth[1:] > 1e-12))
    onsets = [(j, out.time[k], ends.rate[k, j]) for k, j in begun]
    deep = any(0 < gap < peak_depth[:, j].max() for j, gap in enumerate(bar.gaps))
    return SimpleNamespace(
        bar=bar, status=failure.status if failure else Status.SUSPECT if deep else Status.OK,
        message=failure.message if failure else "",
        ok=not failure and not deep, time=at.time, q=at.q[:, model.columns], q_t=at.v[:, model.columns],
        q_tt=at.a[:, model.columns], **vars(here), peak_force=seen[0], peak_depth=seen[1], given=given, held=whole,
        taken=lost, energy_balance=off, steps=counts[1], onsets=onsets, **held, **taken,
    )  # fmt: skip
