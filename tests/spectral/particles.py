"""The four-bar as particles, in plain numpy, and the compiled solver's rates for the same states."""

import numpy as np
import pytest
from fourbar import FourBar, Model, ideal_state, powers, reports_at

pytest.importorskip("numba")

from buckler.mbs import Material, Section
from buckler.mbs.modal import BarModes, Modal
from buckler.mbs.modal.planar import PlanarModel
from buckler.mbs.spectral.dense import at_times
from buckler.mbs.spectral.output import Output
from buckler.mbs.spectral.recording import follow_markers
from buckler.mbs.spectral.tables import Memory

G = (1.7, -9.3)
ONSET = np.array([0.05, 0.1, 0.2, 0.4])
FIRST, SECOND = (0, 1, 2, 0), (1, 2, 3, 3)


class Cloud(Modal):
    """A modal link whose modes are given."""

    def __init__(self, section, modes, given):
        super().__init__(section, modes)
        object.__setattr__(self, "given", given)

    def planar(self, length):
        return self.given


Cloud.__name__ = "Modal"  # registries know kinds by name


class Particles:
    """The four-bar as particles: bodies 0 ground, 1 crank, 2 coupler, 3 rocker; q as in the package.

    Every bar is a pair of particles of the same mass and inertia, the flexible rocker a cloud whose points move with random
    shapes that keep to mean axes. The sections at the rocker's ends and middle have shapes of their own.
    """

    def __init__(self, m, rng, **parameters):
        probe = FourBar()
        self.points = rng.normal(0, 0.05, (7, 2))
        self.weights = rng.uniform(0.01, 0.04, 7)
        self.points -= self.weights @ self.points / self.weights.sum()
        x, y = self.points.T
        rigid = np.stack([np.tile([1.0, 0.0], 7), np.tile([0.0, 1.0], 7), np.stack([-y, x], axis=1).ravel()], axis=1)
        raw = np.hstack([rigid, rng.normal(0, 1.0, (14, m))]) * np.sqrt(np.repeat(self.weights, 2))[:, None]
        self.shapes = (np.linalg.qr(raw)[0][:, 3:] / np.sqrt(np.repeat(self.weights, 2))[:, None]).reshape(7, 2, m)
        self.sections = rng.normal(0, 1.0, (3, 3, m)) * np.array([1, 1, 20])[None, :, None]
        self.frequency, self.damping = rng.uniform(300, 900, m), rng.uniform(0.0, 0.1, m)
        self.m = m
        modes = Cloud(Section(0.005, 0.02, Material(207e9, 7850.0)), BarModes(1, 0), given=self.data(probe.rocker)) if m else None
        self.bar = FourBar(modes=modes, gravity=G, **parameters)

    def data(self, length):
        w, x, phi = self.weights, self.points, self.shapes
        cross = phi[:, 0, :, None] * phi[:, 1, None, :] - phi[:, 1, :, None] * phi[:, 0, None, :]
        return PlanarModel(
            length, w.sum(), float(w @ (x**2).sum(1)), np.array([length / 2, 0.0]), np.arange(1, self.m + 1), self.frequency,
            self.damping, self.sections,
            radial=np.einsum("p,pc,pci->i", w, x, phi), gram=np.einsum("p,pci,pcj->ij", w, phi, phi),
            gyration=np.einsum("p,pij->ij", w, cross), line=x, line_shapes=phi,
        )  # fmt: skip

    def pose(self, body, q, t):
        """Place and direction; complex q allowed, for complex-step derivatives."""
        if body == 0:
            return np.zeros(2, q.dtype), 0.0 * q[0]
        if body == 1:
            return q[0:2], self.bar.start + self.bar.speed * t + 0 * q[0]
        return (q[2:4], q[4]) if body == 2 else (q[5:7], q[7])

    def point(self, body, local, q, t, shape=None):
        (x, angle), local = self.pose(body, q, t), np.asarray(local) + 0 * q[0]
        if shape is not None and self.m:
            local = local + shape @ q[8:]
        c, s = np.cos(angle), np.sin(angle)
        return x + np.array([c * local[0] - s * local[1], s * local[0] + c * local[1]])

    def masses(self):
        """(mass, place as a function of q and t) of all particles that move by q."""
        bar, found = self.bar, []
        for body, mass, inertia in ((1, bar.masses[0], bar.inertias[0]), (2, bar.masses[1], bar.inertias[1])):
            r = np.sqrt(inertia / mass)
            found += [(mass / 2, lambda q, t, b=body, r=sign * r: self.point(b, (r, 0.0), q, t)) for sign in (1, -1)]
        if not self.m:
            r = np.sqrt(bar.inertias[2] / bar.masses[2])
            return found + [(bar.masses[2] / 2, lambda q, t, r=sign * r: self.point(3, (r, 0.0), q, t)) for sign in (1, -1)]
        cloud = zip(self.weights, self.points, self.shapes, strict=True)
        return found + [(w, lambda q, t, x=x, phi=phi: self.point(3, x, q, t, phi)) for w, x, phi in cloud]

    def centre(self, joint, side, q, t):
        """Joint centre on one of its bodies."""
        body = (FIRST, SECOND)[side][joint]
        half = dict(enumerate(self.bar.lengths / 2, start=1))
        if body == 0:
            return np.array([0.0 if joint == 0 else self.bar.frame, 0.0]) + 0 * q[:2]
        along = half[body] * (-1 if joint in (0, 3) or (joint, side) == (1, 1) else 1)
        return self.point(body, (along, 0.0), q, t, self.sections[3 - joint, :2] if body == 3 else None)

    def direction(self, joint, side, q, t):
        """Angle of the section that carries the pin or bush."""
        body = (FIRST, SECOND)[side][joint]
        angle = self.pose(body, q, t)[1]
        return angle + self.sections[3 - joint, 2] @ q[8:] if body == 3 and self.m else angle

    def surface(self, joint, side, spot, q, t, q0):
        """A point that at q0 is at the spot and moves with the section of the pin or bush."""
        arm = spot - np.real(self.centre(joint, side, q0, t))
        turn = self.direction(joint, side, q, t) - np.real(self.direction(joint, side, q0, t))
        c, s = np.cos(turn), np.sin(turn)
        return self.centre(joint, side, q, t) + np.array([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]])


def slope(place, q, h=1e-30):
    """Jacobian by complex steps, shape (2, n)."""
    return np.stack([place(q + 1j * h * e).imag / h for e in np.eye(q.size)], axis=-1)


def velocity(place, q, v, t, h=1e-30):
    """Of a place(q, t), by a complex step along the motion."""
    return place(q + 1j * h * v, t + 1j * h).imag / h


def bias(place, q, v, t, h=1e-5):
    """Acceleration of a place(q, t) if q_tt were 0: fourth-order difference of velocities."""

    def at(s):
        return velocity(place, q + s * v, v, t + s)

    return (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h)


def by_virtual_power(model, q, v, t):
    """Accelerations, forces on the pins, and powers lost, without the package's equations."""
    n, bar = q.size, model.bar
    mass, load = np.zeros((n, n)), np.zeros(n)
    for weight, place in model.masses():
        jacobian = slope(lambda z, place=place: place(z, t), q)
        mass += weight * jacobian.T @ jacobian
        load += weight * jacobian.T @ (np.array(bar.gravity) - bias(place, q, v, t))
    if model.m:
        load[8:] -= model.frequency**2 * q[8:] + 2 * model.damping * model.frequency * v[8:]
    forces, lost = np.zeros((4, 2)), np.zeros((2, 4))
    for j in range(4):
        pin, bush = (model.centre(j, side, q, t) for side in (0, 1))
        e = np.hypot(*(pin - bush))
        depth, across = e - bar.gaps[j], (pin - bush) / e
        spot, along = pin + bar.pin * across, np.array([-across[1], across[0]])
        speeds, jacobians = [], []
        for side in (0, 1):

            def moving(z, s, side=side, spot=spot, j=j):
                return model.surface(j, side, spot, z, s, q)

            speeds.append(velocity(moving, q, v, t))
            jacobians.append(slope(lambda z, moving=moving: moving(z, t), q))
        relative = speeds[0] - speeds[1]
        if depth <= 0:
            continue
        normal = bar.law.force(depth, across @ relative, ONSET[j])
        drag = bar.friction.coefficient(along @ relative) * normal
        forces[j] = -normal * across - drag * along
        load += (jacobians[0] - jacobians[1]).T @ forces[j]
        lost[:, j] = normal * (across @ relative), drag * (along @ relative)
    return np.linalg.solve(mass, load), forces, lost


def compiled(bar, q, v, t):
    """Rates, accelerations, powers, joints (as in `Run`), accelerations of what is watched."""
    model = Model.of(bar)
    state = model.state(np.concatenate([q, v]), t)
    scene, n, r, k = model.scene, model.scene.size, len(model.scene.row_names), len(model.scene.force_names)
    markers = watched(scene)
    memory = scene.memory()
    for i, name in enumerate(scene.force_names):
        memory[i, Memory.ONSET] = ONSET["OABC".index(name[0])]
    one = Output(np.array([t]), state.q[None], state.v[None], np.zeros((1, n)), np.zeros((1, r)), memory[None])
    seen = at_times(scene, one, one.time)
    reports = reports_at(scene, seen)
    power, joints = powers(scene, seen, reports, bar.speed), model.joints(reports, seen.lam)
    lost = np.zeros((2, 4))
    for i, name in enumerate(scene.force_names):
        lost[:, "OABC".index(name[0])] = power[0, [i, k + i]]
    drive = power[0, 2 * k + scene.row_names.index("drive")]
    rush = follow_markers(scene, seen, markers, reports)[:, 2, 0, :2]
    found = np.concatenate([[drive], lost.ravel(), [power[0, -1]]])
    return seen.v[0, model.columns], seen.a[0, model.columns], found, joints, rush.ravel()


def watched(scene):
    """Markers of the coupler's centre, the rocker's, and the material point in the rocker's middle."""
    coupler, rocker = (scene.builder.bodies[link] for link in ("coupler", "rocker"))
    shape = rocker.model.shapes[2].T if rocker.modes else None
    found = [body.marker_at(scene.builder, body.centre) for body in (coupler, rocker)]
    found.append(rocker.marker_at(scene.builder, rocker.centre, shape))
    scene.refresh()
    return found


def state_in_contact(bar, rng, offset=1e-3):
    """Near the ideal one, the centres a few offsets [m] apart, moving."""
    state = ideal_state(bar)
    n = state.size // 2
    q, v = state[:n], state[n:]
    q[:8] += rng.normal(0, offset, 8) * np.array([1, 1, 1, 1, 8, 1, 1, 8])
    q[8:] = rng.normal(0, 1e-4, n - 8)
    return q, v + rng.normal(0, 0.3, n)
