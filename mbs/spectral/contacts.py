"""Contacts over a step, compiled: when they close and let go, and what they remember of it; where other forces have kinks."""

from __future__ import annotations

import numpy as np

from .along import value_along
from .compiling import aside, inner
from .lawtable import normal_force
from .tables import (
    CONTACT,
    DRY,
    FASTEST,
    JOURNAL,
    KIND,
    LAW,
    LAW_OF,
    LENGTH,
    MOTOR,
    NUMBERS,
    ONSET,
    RATE,
    SEAT,
    STRUT,
    VALUE,
)  # fmt: skip

SHARP = 1e-3
"""Share of its distance from a face by which the end of a step may miss it."""
INSIDE, THERE = 1e-3, 1e-5
"""Share of a step after which it is off the event at which it began, and by which it may miss a kink."""
HALVES, SLIGHT, BENT_BY, FIRST = 14, 1e-4, 0.35, 0.6
"""How often the part of a step with a kink is halved; share of the force by which it is off its tangents in a step at least; of
half of that what is left in half of it, of a quarter and so on; how much of the second half's the first half's is at least where
the kink is there."""


@inner
def touches(s, k):
    """Whether force k is a contact."""
    return s.forces[k, KIND] == CONTACT or s.forces[k, KIND] == JOURNAL


@inner
def depth_of(s, reports, k):
    """Depth of contact k, from its report."""
    if s.forces[k, KIND] == JOURNAL:
        return reports[k, LENGTH]
    side, face = s.data[s.forces[k, NUMBERS]], s.data[s.forces[k, NUMBERS] + 1]
    return side * (reports[k, LENGTH] - face)


@inner
def rate_of_depth(s, reports, k):
    """Its rate."""
    return reports[k, RATE] if s.forces[k, KIND] == JOURNAL else s.data[s.forces[k, NUMBERS]] * reports[k, RATE]


@inner
def hermite(x, h, d0, v0, d1, v1):
    """Cubic with these values and slopes at the ends of a step of length h, at the fraction x."""
    return (1.0 - x) ** 2 * ((1.0 + 2.0 * x) * d0 + x * h * v0) + x * x * ((3.0 - 2.0 * x) * d1 + (x - 1.0) * h * v1)


@inner
def hermite_rate(x, h, d0, v0, d1, v1):
    """Its slope there."""
    return 6.0 * x * (1.0 - x) * (d1 - d0) / h + (1.0 - x) * (1.0 - 3.0 * x) * v0 + x * (3.0 * x - 2.0) * v1


@aside
def crossing(h, d0, v0, d1, v1):
    """First fraction of the step at which the cubic, negative at its start, passes zero; 2 if it does not."""
    high = 2.0
    if d1 > 0.0:
        high = 1.0
    elif v0 > 0.0 and v1 < 0.0:
        # both ends outside, in between perhaps inside: look at the top
        a, b = 0.0, 1.0
        for _ in range(40):
            m1, m2 = a + (b - a) / 3.0, b - (b - a) / 3.0
            if hermite(m1, h, d0, v0, d1, v1) < hermite(m2, h, d0, v0, d1, v1):
                a = m1
            else:
                b = m2
        if hermite(0.5 * (a + b), h, d0, v0, d1, v1) > 0.0:
            high = 0.5 * (a + b)
    if high > 1.0:
        return 2.0
    low = 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if hermite(middle, h, d0, v0, d1, v1) > 0.0:
            high = middle
        else:
            low = middle
    return high


@inner
def pushes(s, k, value, rate, m, outside):
    """Whether contact k pushes at its measure and the rate of that, were it so much deeper."""
    number = s.forces[k, NUMBERS]
    side, face = (1.0, 0.0) if s.forces[k, KIND] == JOURNAL else (s.data[number], s.data[number + 1])
    depth = side * (value - face) + outside
    return depth > 0.0 and normal_force(s, s.forces[k, LAW_OF], depth, side * rate, m[ONSET]) > 0.0


@aside
def release(s, before, reports, h, k, m, outside, high):
    """Fraction of the step, up to a highest one, at which a contact that pushes lets go, so far outside its face.

    1 where the step ends there, 2 if it does not. Its measure is the cubic with the values and rates at the step's ends.
    """
    l0, r0, l1, r1 = before[k, LENGTH], before[k, RATE], reports[k, LENGTH], reports[k, RATE]
    low, sharp = INSIDE, SHARP * outside
    if not pushes(s, k, hermite(low, h, l0, r0, l1, r1), hermite_rate(low, h, l0, r0, l1, r1), m, outside):
        return 2.0
    if pushes(s, k, l1, r1, m, outside - sharp) != pushes(s, k, l1, r1, m, outside + sharp):
        return 1.0
    if pushes(s, k, hermite(high, h, l0, r0, l1, r1), hermite_rate(high, h, l0, r0, l1, r1), m, outside):
        return 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if pushes(s, k, hermite(middle, h, l0, r0, l1, r1), hermite_rate(middle, h, l0, r0, l1, r1), m, outside):
            low = middle
        else:
            high = middle
    return high


@inner
def _law(s, before, reports, h, k, m, t, x):
    """Force k at a fraction of the step that ends at time t, of unit reaction where it follows one."""
    l0, r0, l1, r1 = before[k, LENGTH], before[k, RATE], reports[k, LENGTH], reports[k, RATE]
    return value_along(s, k, t - (1.0 - x) * h, hermite(x, h, l0, r0, l1, r1), hermite_rate(x, h, l0, r0, l1, r1), m, 0.0, 1.0)


@aside
def _bend(s, before, reports, h, k, m, t, low, high, side):
    """Over a part of the step: how far force k is from its tangents at both ends, taken inside (side 1) or outside of it (-1);
    where these meet.
    """
    d = side * 1e-3 * (high - low)
    first, last = _law(s, before, reports, h, k, m, t, low), _law(s, before, reports, h, k, m, t, high)
    was = (_law(s, before, reports, h, k, m, t, low + d) - first) / d
    now = (last - _law(s, before, reports, h, k, m, t, high - d)) / d
    off = max(abs(last - first - was * (high - low)), abs(last - first - now * (high - low)))
    meet = (last - first + was * low - now * high) / (was - now) if was != now else high
    return off, min(max(meet, low), high)


@aside
def kink(s, before, reports, h, k, m, t, high):
    """Fraction of the step, up to a highest one, at which the slope of force k first jumps; 1 where the step ends there, else 2.

    A smooth force is four times as near to its tangents in half the step, one with a kink twice. A kink beside an end may hide
    in the tangent there from inside; then it is not in that from outside.
    """
    low = INSIDE
    whole, part = _bend(s, before, reports, h, k, m, t, low, high, 1.0)
    if whole <= SLIGHT * max(abs(_law(s, before, reports, h, k, m, t, low)), abs(_law(s, before, reports, h, k, m, t, high))):
        return 2.0
    for i in range(HALVES):
        middle, whole = 0.5 * (low + high), 0.5 * whole
        off, part = _bend(s, before, reports, h, k, m, t, low, middle, 1.0)
        after, there = _bend(s, before, reports, h, k, m, t, middle, high, 1.0)
        if off >= FIRST * after:
            high = middle
        else:
            low, off, part = middle, after, there
        if i >= 3 and max(off, _bend(s, before, reports, h, k, m, t, low, high, -1.0)[0]) < BENT_BY * whole:
            return 2.0
    return 1.0 if abs(part - 1.0) < THERE else part


@inner
def event(s, before, reports, h, k, m, t, outside, high):
    """Fraction of the step, up to a highest one, at which force k lets go or has a kink; 1 where the step ends there, else 2."""
    kind = s.forces[k, KIND]
    if touches(s, k):
        return release(s, before, reports, h, k, m, outside, high)
    if kind == LAW or kind == DRY or kind == SEAT or kind == STRUT or kind == MOTOR:
        return kink(s, before, reports, h, k, m, t, high)
    return 2.0


@inner
def first_onset(s, before, reports, h, landing, outside, memory, t):
    """Fraction of the step at which the first open contact closes, within the landing; 2 if none does.

    Where `outside` is not zero it is that at which one is so far outside its face, before a push or after it, quite sharply,
    or any force has a kink.
    """
    first = 2.0
    for k in range(s.forces.shape[0]):
        d0, d1 = depth_of(s, before, k), depth_of(s, reports, k)
        if touches(s, k) and d0 < -landing:
            if abs(d1 + outside) > (SHARP * outside if outside > 0.0 else landing):
                rates = rate_of_depth(s, before, k), rate_of_depth(s, reports, k)
                first = min(first, crossing(h, d0 + outside, rates[0], d1 + outside, rates[1]))
        elif outside > 0.0:
            first = min(first, event(s, before, reports, h, k, memory[k], t, outside, 1.0))
    return first


@inner
def short_of(s, before, reports, h, outside, memory, t, nearly):
    """Time at the present rates until the first contact is so far outside its face, or a force has a kink or lets go within a
    share `nearly` of the step; 0 where one is there.
    """
    left = np.inf
    for k in range(s.forces.shape[0]):
        off, rate = depth_of(s, reports, k) + outside, rate_of_depth(s, reports, k)
        part = event(s, before, reports, h, k, memory[k], t, outside, 1.0 + nearly)
        if part == 1.0 or (touches(s, k) and abs(off) <= SHARP * outside):
            return 0.0
        if touches(s, k) and off < 0.0 and rate > 0.0:
            left = min(left, -off / rate)
        left = min(left, h * (part - 1.0))
    return left


@inner
def to_faces(s, reports, landing, most):
    """Time, up to a longest one, after which all contacts that are about to close are half the landing inside."""
    time = 0.0
    for k in range(s.forces.shape[0]):
        if touches(s, k):
            depth, rate = depth_of(s, reports, k), rate_of_depth(s, reports, k)
            if -landing <= depth <= 0.0 and rate > 0.0:
                time = max(time, (0.5 * landing - depth) / rate)
    return min(time, most)


@inner
def lets_go(s, before, reports, largest, share, landing):
    """Whether a contact pushes no more that pushed with a share of its largest force so far, or was passed through.

    There is a kink to be cut out.
    """
    for k in range(s.forces.shape[0]):
        if touches(s, k):
            if reports[k, VALUE] == 0.0 and abs(before[k, VALUE]) > share * largest[k]:
                return True
            if (
                abs(depth_of(s, before, k)) <= landing
                and depth_of(s, reports, k) < -landing
                and rate_of_depth(s, before, k) > 0.0
            ):
                return True
    return False


@inner
def remember_onset(s, before, reports, k, m, floor, graze, landing):
    """Take over what contact k did in a step into its memory m: 1 if it closed, -1 if it let go, else 0.

    A step ends or begins where a contact closes: the speed there is that of its end which is nearer to the face. It counts as
    closed where it is about to and nearer than the landing.
    """
    old, new, rate = depth_of(s, before, k), depth_of(s, reports, k), rate_of_depth(s, reports, k)
    if new > -old >= 0.0:
        rate = rate_of_depth(s, before, k)
    if new <= 0.0 or old <= 0.0:
        m[ONSET] = max(rate, floor, graze * m[FASTEST])
    if (new > 0.0 and old <= 0.0) or (old < -landing <= new and rate > 0.0 and landing > 0.0):
        if s.forces[k, KIND] == CONTACT:
            m[FASTEST] = max(m[FASTEST], m[ONSET])
        return 1
    return -1 if reports[k, VALUE] == 0.0 and before[k, VALUE] != 0.0 else 0


@inner
def closing(s, before, reports, least):
    """Time from a step's start, or, negative, from its end, to where a contact that closes is as far beyond its face as there.

    0 if none closes.
    """
    for k in range(s.forces.shape[0]):
        if touches(s, k):
            old, new = depth_of(s, before, k), depth_of(s, reports, k)
            if new > 0.0 >= old:
                near = new > -old
                rate = rate_of_depth(s, before if near else reports, k)
                if rate > 0.0:
                    return (least if near else -least) - 2.0 * (old if near else new) / rate
    return 0.0


@inner
def bend_of_depths(s, before, reports, h):
    """How far depths of closed contacts are from straight lines over a step, of each."""
    most = 0.0
    for k in range(s.forces.shape[0]):
        if touches(s, k):
            deep = max(depth_of(s, before, k), depth_of(s, reports, k))
            if deep > 0.0:
                most = max(most, 0.125 * h * abs(rate_of_depth(s, reports, k) - rate_of_depth(s, before, k)) / deep)
    return most


@inner
def error_of_depth(s, before, reports, shifted, h, k, least, noise):
    """Error of contact k's depth over that depth, or over its way in the step, or the least that counts; 0 where it is noise.

    `shifted` are reports at the error's end.
    """
    old, new = depth_of(s, before, k), depth_of(s, reports, k)
    deep = max(old, new)
    if deep <= 0.0:
        return 0.0
    way, off = h * max(abs(rate_of_depth(s, before, k)), abs(rate_of_depth(s, reports, k))), abs(depth_of(s, shifted, k) - new)
    return off / max(deep, way, least) if off > noise else 0.0
