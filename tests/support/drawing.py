"""How the figures of studies are tested."""

from buckler.studies.kit.style import house_style


def inked(study, result):
    """The figure or figures of a result as they are, and nothing warned about."""
    with house_style():
        made = study.figure(result)
        for figure in made.values() if isinstance(made, dict) else [made]:
            figure.canvas.draw()
    return made


def drawn(study, result):
    """The figure of a result: every axis named, curves with a legend."""
    figure = inked(study, result)
    assert all(ax.get_ylabel() for ax in figure.axes) and figure.axes[-1].get_xlabel()
    assert any(ax.get_legend() for ax in figure.axes)
    return figure


def value(result, name):
    return result.metrics[name].value
