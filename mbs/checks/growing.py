"""Growth rates of the bending of strips in the poses of a run, from the tangent of the compiled solver's equations.

In each pose a strip has its stress-free shape, put at the recorded start, turned with the recorded chord and stretched by its
tension. The shape is not scaled to the chord, so that its end is only near the recorded end. The multipliers of constraints
balance the applied forces best, by least squares, without inertia.
"""

from typing import Any

import numpy as np

from ..geometry import Array
from ..record.record import Record
from ..spectral.scene import CompiledScene
from ..statics.problem import Problem
from ..statics.spectrum import spectrum


class Growth:
    """Growth rates of the strips' bending, from the spectrum of the equations linearised about a pose of the run."""

    def __init__(self, record: Record) -> None:
        self.record = record
        self.scene = CompiledScene.of(record.mechanism, degree=10)  # errs by 0.1 % in the first three bending modes of a strip
        self.problem = Problem(self.scene)

    def at(self, k: int, forces: dict[str, float]) -> dict[str, float]:
        """Compute the growth rate [1/s] of each strip's bending at sample k, from the strips' tensions [N] by name."""
        q = self._pose(k, forces)
        # a pose without velocity, in general no equilibrium; its parameter is without effect, as the problem varies no load
        rest = self.problem.start(1.0)._replace(q=q)
        tangent = self.problem.linearise(rest._replace(multipliers=self.problem.compute_multipliers(rest)))
        if tangent.definite:  # no small motion grows
            return dict.fromkeys(forces, 0.0)
        found = spectrum(tangent)
        growing = [(float(found.growth[i]), np.real(found.shapes[:, i])) for i in np.flatnonzero(found.growth > 0.0)]
        return {name: max((rate for rate, mode in growing if self._bends(name, q, mode)), default=0.0) for name in forces}

    def _pose(self, k: int, forces: dict[str, float]) -> Array:
        """Return the coordinates of the scene at sample k."""
        q = self.scene.q0.copy()
        for name, motion in self.record.links.items():
            body: Any = self.scene.builder.bodies[name]
            link = self.record.mechanism.link(name)
            if link.body.meshed:  # a strip; any other link is put without deformation
                self._place_strip(q, name, body, k, forces.get(name, 0.0))
            else:
                place, _velocity, _acceleration = motion.centre()
                turn_since_start, _rate = motion.turn(link.start)
                q[body.offset : body.offset + 3] = [*place[k], q[body.offset + 2] + turn_since_start[k]]  # x, y, angle
        for offset, name, point, is_rotor in self.scene.builder.separate_masses:  # with own coordinates: x and y, or an angle
            if not is_rotor:  # the angle of a rotor is only in a linear constraint, so that the tangent does not depend on it
                place, _velocity = self.record.links[name].point(point)
                q[offset : offset + 2] = place[k]
        return q

    def _place_strip(self, q: Array, name: str, strip: Any, k: int, force: float) -> None:
        """Set the coordinates of a strip in its stress-free shape between its ends, stretched by a force.

        `dofs` of a piece are indices in q of its coefficients of x, y and, for beams, theta. The first two coefficients are
        values at the ends of the piece, at the arc lengths `piece.start` and `piece.end` [m]; the others belong to polynomials
        that vanish there.
        """
        link, motion = self.record.mechanism.link(name), self.record.links[name]
        start, end = (motion.point(point)[0] for point in (link.start, link.end))
        first_chord, chord = (end - start)[0], (end - start)[k]
        turn = float(np.arctan2(first_chord[0] * chord[1] - first_chord[1] * chord[0], first_chord @ chord))
        c, s = np.cos(turn), np.sin(turn)
        strain, along = force / link.body.section.axial_stiffness, chord / np.linalg.norm(chord)
        origin = self.scene.q0[strip.pieces[0].dofs[:2, 0]]
        for piece in strip.pieces:
            x, y = self.scene.q0[piece.dofs[:2]]
            is_end = np.arange(len(x)) < 2
            x, y = x - origin[0] * is_end, y - origin[1] * is_end
            turned = np.array([c * x - s * y + start[k, 0] * is_end, s * x + c * y + start[k, 1] * is_end])
            turned[:, :2] += along[:, None] * strain * np.array([piece.start, piece.end])
            q[piece.dofs[:2]] = turned
            if len(piece.dofs) > 2:
                q[piece.dofs[2]] = self.scene.q0[piece.dofs[2]] + turn * is_end

    def _bends(self, name: str, q: Array, mode: Array) -> bool:
        """Return True if a strip deflects from its chord in a mode (n,) about q, relative to the mode's largest motion."""
        strip: Any = self.scene.builder.bodies[name]
        first, last = strip.pieces[0].dofs[:2, 0], strip.pieces[-1].dofs[:2, 1]
        chord = q[last] - q[first]
        normal = np.array([-chord[1], chord[0]]) / np.linalg.norm(chord)
        deflection = 0.0
        for piece in strip.pieces:
            arc = np.array([piece.start, piece.end]) / strip.pieces[-1].end  # share of the length, 0 to 1
            of_chord = normal @ mode[first] * (1 - arc) + normal @ mode[last] * arc
            at_ends = normal @ mode[piece.dofs[:2, :2]] - of_chord
            inner = normal @ mode[piece.dofs[:2, 2:]]  # coefficients of polynomials below 1: the largest counts as deflection
            deflection = max(deflection, float(np.abs(at_ends).max()), float(np.abs(inner).max(initial=0.0)))
        motions = np.abs(mode / self.scene.units * self.scene.length)  # [m]; angles count at the arm of the longest link
        return deflection > 0.05 * float(motions.max())  # 0.05 is chosen: less is a motion of the mechanism
