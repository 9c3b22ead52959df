"""The exact elastic strip: closed form, boundary value problem, fast law, paths through limit points, vibration.

pinned : closed form by elliptic integrals, both ways
rod : the same strip as a boundary value problem, extensible, shearable and imperfect
law : the published quartic fit, and a fast law with a stated error
strip : any ends, clamped or pinned, and any stress-free shape, under dead loads and displacements
path : equilibria of a `strip` through limit points, with branchings
shapes : stress-free shapes, such as arches
vibration : natural frequencies of Timoshenko's beam and of frames
moving : the strip in motion between a driven pin and a slider

All quantities but those of `moving` and `vibration` are normalised by the strip's length L and bending stiffness E I: shortening
u = U/L, load p = P L^2/(E I). Needs numpy and scipy only.
"""

from buckler.elastica import law, moving, path, pinned, rod, shapes, strip, vibration

__all__ = ["law", "moving", "path", "pinned", "rod", "shapes", "strip", "vibration"]
