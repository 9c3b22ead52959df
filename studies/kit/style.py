"""The house style of figures, for studies: see `buckler.mbs.files.style`."""

from buckler.mbs.files.style import COLOURS, STYLE, WIDTH, house_style, subplots

__all__ = ["COLOURS", "STYLE", "WIDTH", "house_style", "subplots"]
