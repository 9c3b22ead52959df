"""Runs of the slider-crank's studies."""

import io

from buckler.studies.striking import slider_crank
from buckler.studies.striking.impact import read
from buckler.studies.striking.impact_models import strike


def value(result, name):
    return result.metrics[name].value


def drawn(study, result):
    """Figures of a result, written as the command line writes them."""
    figure = study.figure(result)
    for ax in figure.axes:
        assert ax.get_xlabel().endswith("]") or "ln" in ax.get_xlabel()
    figure.savefig(io.BytesIO(), format="pdf")
    return figure


def peak(stop=7.2e4, speed=1.25, **changes):
    return read(strike("beam", slider_crank.Parameters(**changes), stop, speed)).impact_peak
