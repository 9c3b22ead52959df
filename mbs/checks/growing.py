"""Growth rates of the bending of strips in the poses of a run, from the tangent of the compiled solver's equations."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..geometry import Array
from ..record.record import Record
from ..spectral.scene import CompiledScene
from ..statics.problem import Problem
from ..statics.spectrum import spectrum

DEGREE = 10
"""Degree of the strips: the error of their first three bending modes is a tenth of a per cent."""
BENDING_SHARE = 0.05
"""Least deflection of a strip from its chord, over the largest motion of a shape: less is a motion of the mechanism."""


class Growth:
    """Growth rates of bending in the poses of a run."""

    def __init__(self, record: Record) -> None:
        self.record, self.scene = record, CompiledScene.of(record.mechanism, DEGREE)
        self.problem = Problem(self.scene)

    def at(self, k: int, forces: dict[str, float]) -> dict[str, float]:
        """Compute the growth rate, 1/s, of each strip's bending at a sample, for mean normal forces, N; zero if it decays."""
        q = self._pose(k, forces)
        rest = self.problem.start(1.0)._replace(q=q)
        tangent = self.problem.about(rest._replace(multipliers=self.problem.balancing(rest)))
        if tangent.definite:
            return dict.fromkeys(forces, 0.0)
        found = spectrum(tangent)
        grows = np.flatnonzero(found.growth > 0.0)
        return {
            name: max((float(found.growth[i]) for i in grows if self._bends(name, q, np.real(found.shapes[:, i]))), default=0.0)
            for name in forces
        }

    def _pose(self, k: int, forces: dict[str, float]) -> Array:
        """Return the coordinates of the scene at a sample."""
        q = self.scene.q0.copy()
        for name, motion in self.record.links.items():
            body: Any = self.scene.builder.bodies[name]
            made = self.record.mechanism.link(name)
            if made.body.meshed:
                self._place_strip(q, name, body, k, forces.get(name, 0.0))
            else:
                place, turned = motion.centre()[0][k], motion.turn(made.start)[0][k]
                q[body.offset : body.offset + 3] = [*place, q[body.offset + 2] + turned]
        for offset, link, point, turns in self.scene.builder.separate_masses:
            if not turns:
                q[offset : offset + 2] = self.record.links[link].point(point)[0][k]
        return q

    def _place_strip(self, q: Array, name: str, strip: Any, k: int, force: float) -> None:
        """Set the coordinates of a strip in its stress-free shape between its ends, stretched by a force."""
        link, motion = self.record.mechanism.link(name), self.record.links[name]
        start, end = (motion.point(point)[0] for point in (link.start, link.end))
        chords = end - start
        chord, begun = chords[k], chords[0]
        turn = float(np.arctan2(begun[0] * chord[1] - begun[1] * chord[0], begun @ chord))
        c, s = np.cos(turn), np.sin(turn)
        strain, along = force / link.body.section.axial_stiffness, chord / np.linalg.norm(chord)
        origin = self.scene.q0[strip.elements[0].places[:2, 0]]
        values: dict[int, float] = {}
        for element in strip.elements:
            x, y = self.scene.q0[element.places[:2]]
            x, y = x - origin[0] * _ends(x), y - origin[1] * _ends(y)
            stretch = strain * np.array([element.start, element.end])
            turned = np.array([c * x - s * y + start[k, 0] * _ends(x), s * x + c * y + start[k, 1] * _ends(x)])
            turned[:, :2] += along[:, None] * stretch
            for i in (0, 1):
                values |= dict(zip(element.places[i].tolist(), turned[i].tolist(), strict=True))
            if len(element.places) > 2:
                values |= dict(
                    zip(element.places[2].tolist(), (self.scene.q0[element.places[2]] + turn * _ends(x)).tolist(), strict=True)
                )
        q[list(values)] = list(values.values())

    def _bends(self, name: str, q: Array, shape: Array) -> bool:
        """Return True if a shape is one of a strip's bending."""
        strip: Any = self.scene.builder.bodies[name]
        first, last = strip.elements[0].places[:2, 0], strip.elements[-1].places[:2, 1]
        chord = q[last] - q[first]
        normal = np.array([-chord[1], chord[0]]) / np.linalg.norm(chord)
        bent = 0.0
        for element in strip.elements:
            inner = normal @ shape[element.places[:2, 2:]]
            part = np.array([element.start, element.end]) / strip.length
            line = normal @ shape[first] * (1 - part) + normal @ shape[last] * part
            bent = max(
                bent, float(np.abs(normal @ shape[element.places[:2, :2]] - line).max()), float(np.abs(inner).max(initial=0.0))
            )
        moves = np.abs(shape / self.scene.units * self.scene.length)
        return bent > BENDING_SHARE * float(moves.max())


def _ends(values: Array) -> Array:
    """Return 1 for the two basis functions of the ends, 0 for the others."""
    out = np.zeros(len(values))
    out[:2] = 1.0
    return out
