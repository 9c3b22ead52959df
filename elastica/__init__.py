"""The exact elastic strip between two pins: closed form, second opinion, fast law.

pinned : closed form by elliptic integrals, both ways
rod : the same strip as a boundary value problem, extensible, shearable and imperfect
law : the published quartic fit, and a fast law with a stated error
moving : the strip in motion between a driven pin and a slider

All quantities but those of `moving` are normalised by the strip's length L and bending stiffness E I: shortening u = U/L, load
p = P L^2/(E I). Needs numpy and scipy only.
"""

from buckler.elastica import law, moving, pinned, rod

__all__ = ["law", "moving", "pinned", "rod"]
