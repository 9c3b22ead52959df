"""Runs of the slider-crank's studies."""

from drawing import inked

from buckler.studies.striking import slider_crank
from buckler.studies.striking.impact import read
from buckler.studies.striking.impact_models import strike


def value(result, name):
    return result.metrics[name].value


def drawn(study, result):
    """Figures of a result, their axes named with units."""
    figure = inked(study, result)
    for ax in figure.axes:
        assert ax.get_xlabel().endswith("]") or "ln" in ax.get_xlabel()
    return figure


def peak(stop=7.2e4, speed=1.25, **changes):
    return read(strike("beam", slider_crank.Parameters(**changes), stop, speed)).impact_peak
