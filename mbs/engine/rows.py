"""Constraints of elements in the engine: native items for pins and angles, user functions for other rows.

A row is one scalar equation: a sum of coefficients times measures of two bodies keeps its value. A measure is a turn, a distance
of two points, or a coordinate of a point along a line. Rows of drives, which follow a motion, are added in `loads`.
"""

import exudyn.itemInterface as eii
import numpy as np

from ..elements.element import GROUND, Element, Place
from ..elements.rows import Row, Turn, find_pin
from ..geometry import Array
from ..record.record import Record
from ..scene.forms import Ends, Forms
from . import System
from .placed import History
from .scene import EngineScene, Reader


def connect(scene: EngineScene, elements: dict[str, Element]) -> None:
    """Add the rows of each element; its `reactions`, from multipliers with opposite sign, are its channels in the record.

    A strut has no coordinates and acts directly on the bodies at its ends: rows with a strut are left out.
    """
    for name, element in elements.items():
        rows = list(element.rows(scene.mechanism))
        if any(row.bodies & scene.strut_links for row in rows):
            continue
        constraints = {f"{name}: {k}" if k else name: item for k, item in enumerate(_add(scene, rows))}
        scene.constraints |= constraints
        no_samples = np.zeros((0, len(rows)))  # for the names of the channels
        for channel in element.reactions(no_samples) or ():
            scene.add_reader(name, channel, _make_reader(scene, list(constraints), element, channel))


def _add(scene: EngineScene, rows: list[Row]) -> list[int]:
    """Add rows as native constraints, one for a pin and one for each turn, if possible, else as one item; return item numbers.

    A measure is first end less second; the constraint of the engine is second marker less first. Hence the order of markers.
    """
    pin = find_pin(rows)
    if pin is None:
        return [RowConstraint(scene, rows).add()]
    markers = [scene.position_marker(*end) for end in (pin.second, pin.first)]
    items = [int(scene.system.AddObject(eii.ObjectJointRevolute2D(markerNumbers=markers)))]
    for row in rows[2:]:  # `find_pin` has returned a pin: the first two rows are its x and y, all others are constant turns
        _coefficient, turn = row.terms[0]  # the only term, with the coefficient 1
        markers = [scene.angle_marker(*end) for end in (turn.second, turn.first)]  # of the bodies' angles
        items.append(int(scene.system.AddObject(eii.CoordinateConstraint(markerNumbers=markers))))
    return items


def _make_reader(scene: EngineScene, constraints: list[str], element: Element, channel: str) -> Reader:
    """Make the reader of a channel from the multipliers of an element's constraints."""

    def read(run: History, _record: Record) -> Array:
        """Return the channel's values (times, ...)."""
        columns = np.concatenate([scene.multiplier_indices(name) for name in constraints])
        return (element.reactions(-run.multipliers[:, columns]) or {})[channel]  # not None, as it has this channel

    return read


class RowConstraint:
    """Rows as one constraint on the coordinates (x, y, angle) of engine nodes.

    `nodes` maps node numbers to positions at t = 0 [m], `at` maps ends of measures to node numbers, `order` lists these numbers
    in the order of the coordinates. `forms.system` computes residuals (rows,) and their Jacobian (rows, 3 nodes) from the
    position and the angle since t = 0 of each node, (nodes, 3).
    """

    def __init__(self, scene: EngineScene, rows: list[Row]) -> None:
        self.scene, self.points = scene, scene.mechanism.points
        self.nodes: dict[int, Array] = {}
        self.at: dict[Place, int] = {}
        for row in rows:
            for _, measure in row.terms:
                for end in (measure.first, measure.second):
                    if end.body != GROUND:
                        # node (x, y, angle) that moves with the body at the point; its position at t = 0
                        node, position = scene.placed[end.body].find_angle_node(end.point)
                        self.nodes[node], self.at[end] = position, node
        self.order = list(self.nodes)
        self.forms = Forms(rows, len(self.order), Ends(body=self._index, arm=self._arm, position=self._position))
        self.is_linear = all(isinstance(measure, Turn) for row in rows for _, measure in row.terms)

    def _index(self, end: Place) -> int:
        # the ground has the index after the last node
        return len(self.order) if end.body == GROUND else self.order.index(self.at[end])

    def _position(self, end: Place) -> complex:
        return complex(*self.points[end.point])

    def _arm(self, end: Place) -> complex:
        """Return the vector from the node to the point at t = 0 [m], as a complex number."""
        return self._position(end) - (0j if end.body == GROUND else complex(*self.nodes[self.at[end]]))

    def add(self) -> int:
        """Add the constraint: native if linear in the coordinates, else with callbacks."""
        system, forms = self.scene.system, self.forms
        # x, y, angle of each node
        reference = np.array([system.GetNodeParameter(node, "referenceCoordinates")[:3] for node in self.order])
        # the engine's total coordinates include the angles at t = 0, those of `forms` do not; shape (nodes, 3), 0 for x and y
        initial_angles = reference * (0.0, 0.0, 1.0)
        # an object without mass collects the coordinates of all nodes for one marker; the other marker of the constraint has none
        collector = system.AddObject(eii.ObjectGenericODE2(nodeNumbers=self.order, massMatrix=np.zeros(2 * [reference.size])))
        ground = system.AddMarker(eii.MarkerNodeCoordinates(nodeNumber=system.AddNode(eii.NodePointGround())))
        markers = [ground, system.AddMarker(eii.MarkerObjectODE2Coordinates(objectNumber=collector))]
        if self.is_linear:
            _, matrix = forms.system(reference - initial_angles)
            # A q - b = 0 for the total coordinates q of the second marker, A = `scalingMarker1`: the turns since t = 0 are zero
            options: dict[str, object] = {"scalingMarker1": matrix, "offset": matrix @ reference.ravel()}
            return int(system.AddObject(eii.CoordinateVectorConstraint(markerNumbers=markers, **options)))

        def value(_system: System, _time: float, _item: int, q: Array, q_t: Array, on_speeds: bool) -> Array:
            """Return the residual of the rows, or its rate if the engine solves for velocities."""
            residual, gradient = forms.system(np.reshape(q, reference.shape) - initial_angles)
            return gradient @ np.asarray(q_t) if on_speeds else residual

        def jacobian(_system: System, _time: float, _item: int, q: Array, _q_t: Array, _on_speeds: bool) -> Array:
            """Return the Jacobian of the rows by the angles."""
            _, gradient = forms.system(np.reshape(q, reference.shape) - initial_angles)
            return gradient

        options = {"constraintUserFunction": value, "jacobianUserFunction": jacobian}
        shape = np.zeros((forms.row_count, reference.size))  # of it the engine reads the number of equations alone
        return int(system.AddObject(eii.CoordinateVectorConstraint(markerNumbers=markers, scalingMarker0=shape, **options)))
