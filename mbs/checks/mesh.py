"""Self-check of the mesh: how wrong the bending load of a strip is for want of elements, by the strip's own curvature.

The curvature of an element is constant (2 nodes) or linear (3 nodes, cables), and nearly exact at its integration points. What is
missing between them is seen from the next ones: with h the element's length and <> the mean along the strip, the load is off by

    h^2 <kappa'^2> / 6 <kappa^2>,    h^4 <kappa''^2> / 360 <kappa^2>,

twice the error of the bending energy, as it is for the Euler load: 1.6/n^2 and 0.27/n^4 of n elements, 1.7 and 0.26 found.
An element that turns far in itself is wrong beyond that (a strip's exact load, 1 to 16 elements: docs/validation.md): by
3e-4 a^6 of the turn a [rad] of the elements that turn farthest, cables by 1.2e-2 a^4.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from buckler.mbs.accuracy.predictable import wholly_compared
from buckler.mbs.checks.check import Check
from buckler.mbs.checks.unbuckled import no_strip
from buckler.mbs.record.motion import chosen
from buckler.mbs.record.record import Record
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run

Array = np.ndarray[Any, Any]
MESH = 0.05
"""Error of the bending load from which a mesh is too coarse. A strip 1.7 % too thick errs as much; rolled ones are no truer."""
STRUCK = 3e-3
"""The same for a strip that pushes a point against its stop: force, impulse and time of its rebounds are 5 to 7 times as wrong
(slider-crank of 0.3 mm, 1 to 16 elements of each kind against 16 of 3 nodes)."""
SAMPLES = 48
"""Times looked at, evenly over the run."""
BENT = 0.02
"""Turn of a strip from end to end, there and back, rad, below which it is too straight for its mesh to matter to the motion."""


def _too_coarse(run: Run, _result: Result) -> Iterator[str]:
    """The strips with too few elements."""
    record = run.record
    struck = {stop.point for stop in record.mechanism.stops}
    for link in record.mechanism.links:
        if link.body.meshed:
            allowed = STRUCK if struck & set(link.points) else MESH
            motion = record.links[link.name]
            own = getattr(motion, "space_error", None)  # of a solver whose strips tell it themselves
            error = own() if own else mesh_error(record, link.name)
            if error > allowed and (own is None or _bent(motion.strains()[-1])):
                count = "this degree" if own else f"{motion.body.count} elements"
                yield f"with {count} the bending load of '{link.name}' is off by about {error:.1g}, allowed {allowed:g}"


def _idle(run: Run, result: Result) -> str:
    """Where a whole run of other elements was compared, curvature tells nothing more."""
    if result.error.elements and wholly_compared(run.record.mechanism, result):
        return "a whole run of other elements was compared"
    return no_strip(run, result)


def mesh_error(record: Record, name: str) -> float:
    """Relative error of a flexible link's bending load for want of elements, over the run.

    Parameters
    ----------
    name : str
        A link that is a Beam or a Cable.
    """
    looks = np.interp(np.linspace(0, record.time[-1], SAMPLES), record.time, np.arange(len(record.time)))
    strip = chosen(record.links[name], np.unique(looks.astype(int)))
    bending = strip.strains()[-1]
    points = bending.value.shape[-1]
    if not _bent(bending):
        return 0.0
    values, weights = [], []
    for kappa, places in _stretches(record, name, bending.value, strip.pieces):
        slope = np.diff(kappa, axis=1) / np.diff(places)
        if points == 1:
            values.append(slope)
            weights.append(np.diff(places))
        else:
            between = (places[2:] - places[:-2]) / 2
            values.append(np.diff(slope, axis=1) / between)
            weights.append(between)
    h = strip.pieces.max()
    missed = (h**2 / 6 if points == 1 else h**4 / 360) * _mean_square(np.hstack(values), np.concatenate(weights))
    all_of_it = bending.value.reshape(len(bending.value), -1)
    turn = float(np.abs((bending.value * bending.weights).sum(axis=-1)).max())
    c, order = strip.body.worth.far
    return missed / _mean_square(all_of_it, np.ones(all_of_it.shape[1])) + c * turn**order


def _bent(bending: Any) -> bool:
    """Whether a strip turns at any time so far that its mesh matters."""
    return bool((np.abs(bending.value) * bending.weights).sum(axis=(1, 2)).max() >= BENT)


def _stretches(record: Record, name: str, curvature: Array, pieces: Array) -> Iterator[tuple[Array, Array]]:
    """Yield curvatures (times, k) at places (k,), m, between neighbouring points of a link, where nothing acts on it.

    Where no element exerts a moment at an end of the link, the curvature is zero there.
    """
    link, elements = record.mechanism.link(name), record.mechanism.elements().values()
    turned = {at for element in elements for at in element.moments(record.mechanism)}
    body: Any = link.body
    cuts = sorted({node // body.step for node in record.links[name].nodes.values()})
    gauss = (np.polynomial.legendre.leggauss(curvature.shape[-1])[0] + 1) / 2
    edges = np.concatenate([[0.0], np.cumsum(pieces)])
    for a, b in pairwise(cuts):
        kappa = curvature[:, a:b].reshape(len(curvature), -1)
        places = (edges[a:b, None] + np.outer(pieces[a:b], gauss)).ravel()
        if a == 0 and f"{name}:{link.start}" not in turned:
            kappa, places = np.pad(kappa, ((0, 0), (1, 0))), np.concatenate([edges[:1], places])
        if b == len(pieces) and f"{name}:{link.end}" not in turned:
            kappa, places = np.pad(kappa, ((0, 0), (0, 1))), np.concatenate([places, edges[-1:]])
        yield kappa, places


def _mean_square(values: Array, weights: Array) -> float:
    """Mean of squares over all times and places; 0 of none."""
    return float((values**2 @ weights).sum() / weights.sum()) if len(weights) else 0.0


CHECK = Check(
    "MESH",
    "failed when a strip has too few elements for its own curvature",
    _too_coarse,
    {"bending load": MESH, "bending load of what strikes": STRUCK, "bent": BENT},
    _idle,
)
