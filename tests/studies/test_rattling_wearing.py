"""Wear against closed forms: volumes, a turning pin, a pin that sinks into its bush; order of the jumps."""

from math import pi

import numpy as np
import pytest
from scipy.optimize import brentq

from buckler.studies.rattling.wearing import BUSH, PIN, Rubbing, directions, fitted, jumps, room, shares

GAP, BINS = 2.5e-4, 720


def pressed(reach, angle, depth, rubbed, bush=0.0, pin=0.0):
    """Samples of a pin that is pressed in given directions."""
    angle = np.atleast_1d(angle)
    one = np.ones_like(angle)
    place = reach * np.column_stack([np.cos(angle), np.sin(angle)])
    return Rubbing(place, depth * one, rubbed * one, (bush * one, pin * one))


def test_what_is_worn_is_what_was_rubbed():
    """Archard's volume, whatever the shapes: the shares of both surfaces add up to the work that wears."""
    rng = np.random.default_rng(0)
    n = 3000
    rub = Rubbing(
        GAP * rng.uniform(0.9, 1.1, (n, 1)) * np.column_stack([np.cos(t := rng.uniform(-9, 9, n)), np.sin(t)]),
        rng.uniform(-1e-6, 3e-6, n), rng.uniform(0, 2, n), (rng.uniform(-9, 9, n), rng.uniform(-9, 9, n)),
    )  # fmt: skip
    worn = rng.uniform(0, 2e-5, (2, 90))
    for side in (BUSH, PIN):
        assert shares(rub, GAP, worn, side).sum() * 2 * pi / 90 == pytest.approx(rub.rubbed[rub.depth > 0].sum(), rel=1e-12)


def test_a_turning_pin_under_a_constant_load_wears_evenly_and_its_bush_where_it_is_pressed():
    turned = np.linspace(0, 2 * pi, 5000, endpoint=False)
    rub = pressed(GAP + 1e-6, np.full(5000, 0.7), 1e-6, 1.0)._replace(turned=(np.zeros(5000), turned))
    none = np.zeros((2, BINS))
    pin, bush = shares(rub, GAP, none, PIN), shares(rub, GAP, none, BUSH)
    assert pin == pytest.approx(5000 / (2 * pi), rel=5e-3)
    theta = directions(BINS)
    half = np.sqrt(2 * 1e-6 / GAP)
    assert theta[np.argmax(bush)] == pytest.approx(0.7, abs=2 * pi / BINS)
    assert (bush[np.abs(theta - 0.7) > 1.1 * half] == 0).all()


def test_wear_stands_in_the_body_it_is_of():
    """The bush has turned by a right angle, the pin by half a turn: the groove's direction in either is what is left of it."""
    rub = pressed(GAP + 1e-6, [0.5], 1e-6, 1.0, bush=pi / 2, pin=pi)
    theta, none = directions(BINS), np.zeros((2, BINS))
    for side, angle in ((BUSH, 0.5 - pi / 2), (PIN, 0.5 - pi)):
        assert theta[np.argmax(shares(rub, GAP, none, side))] == pytest.approx(angle % (2 * pi), abs=2 * pi / BINS)


def sunk(worn):
    """How far a round pin can go in direction 0."""
    theta = directions(len(worn))
    facing = np.cos(theta) > 0.05
    return float(np.min((GAP + worn[facing]) / np.cos(theta[facing])))


def test_a_pin_sinks_into_its_bush_as_the_closed_form_says():
    """A pin that does not wear leaves its own circle: depth e cos(theta) - c, volume (e sin a - c a) 2, cos a = c/e."""
    volume = 4e-5  # depth times angle, m rad
    theta = directions(BINS)

    def rate(worn):
        reach = sunk(worn[0])
        depth = 2e-7
        found = shares(pressed(reach + depth, [0.0], depth, 1.0), GAP, np.stack([worn[0], np.zeros(BINS)]), BUSH)
        return found[None] * volume

    *_, last = jumps(rate, np.zeros((1, BINS)), 1.0, 1e-7)
    reach = brentq(lambda e: 2 * (np.sqrt(e**2 - GAP**2) - GAP * np.arccos(GAP / e)) - volume, 1.0001 * GAP, 3 * GAP)
    expected = np.maximum(reach * np.cos(theta) - GAP, 0.0)
    assert expected.max() > 0.1 * GAP
    assert np.abs(last.worn[0] - expected).max() < 0.03 * expected.max()
    assert last.worn[0].sum() * 2 * pi / BINS == pytest.approx(volume, rel=1e-9)


@pytest.mark.parametrize(
    ("rate", "right"),
    [
        (lambda y: 1 + y, np.exp(2.0) - 1),
        (lambda y: (1 + y) ** 2, 9.0),  # from 0, to 0.9 turns
        (lambda y: 1 - y, 1 - np.exp(-2.0)),
        (lambda y: np.exp(-2 * y), np.log(5.0) / 2),
    ],
    ids=["grows", "grows ever faster", "falls", "falls ever slower"],
)
def test_what_jumps_tell_is_a_bound_and_near_where_the_rate_rises_and_falls_and_of_second_order(rate, right):
    turns, errors, counts = 0.9 if right == 9.0 else 2.0, [], []
    for allowed in (1e-3, 1e-4, 1e-5):
        course = list(jumps(rate, np.zeros((1, 64)), turns, allowed))
        errors.append(abs(course[-1].worn[0, 0] - right))
        counts.append(len(course))
        assert 1.0 <= course[-1].error / errors[-1] <= 3.0
    assert np.polyfit(np.log(counts), np.log(errors), 1)[0] < -1.7


def test_the_room_a_groove_leaves():
    """All round, it is the depth; as wide as a narrow scratch, nothing; as the pin's own circle, that circle."""
    theta = directions(BINS)
    assert room(GAP, np.full(BINS, 1e-5)) == pytest.approx(GAP + 1e-5, rel=1e-12)
    scratch = np.where(np.abs(theta - 1.0) < 0.01, 1e-4, 0.0)
    assert room(GAP, scratch).max() < 1.02 * GAP
    reach = 1.2 * GAP
    groove = np.maximum(reach * np.cos(theta) - GAP, 0.0)
    assert room(GAP, groove)[0] == pytest.approx(reach, rel=1e-3)


def test_the_fit_is_what_a_clearance_takes():
    grown = 1e-5 + 4e-6 * np.cos(2 * directions(BINS)) - 3e-6 * np.sin(3 * directions(BINS))
    mean, parts = fitted(GAP, grown)
    assert mean == pytest.approx(1e-5, rel=0.02)
    assert parts[2] == pytest.approx(4e-6, rel=0.02)
    assert parts[5] == pytest.approx(-3e-6, rel=0.02)
