"""Mechanisms with welds, sliders and slots."""

import math

from buckler.mbs import Section

G = 9.81
BAR = Section(0.020, 0.004)


def turned(angle, *points):
    c, s = math.cos(angle), math.sin(angle)
    return [(c * x - s * y, s * x + c * y) for x, y in points]
