"""Magnets in the engine."""

import exudyn.itemInterface as eii

from buckler.mbs.elements.element import place
from buckler.mbs.elements.references import holder_reference


def connect(scene, magnets):
    """Join the points by a spring whose force is the magnets'."""
    for magnet in magnets.values():
        markers = [scene.marker(*place(holder_reference(scene.mechanism, at))) for at in (magnet.a, magnet.b)]

        def force(_system, _t, _item, length, *_, strength=magnet.strength):
            return strength / length**2

        item = eii.ObjectConnectorSpringDamper(markerNumbers=markers, referenceLength=0.0, springForceUserFunction=force)
        scene.system.AddObject(item)
