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
    """The figure of a result: every axis named."""
    figure = inked(study, result)
    for ax in figure.axes:
        assert ax.get_ylabel()
        assert ax.get_legend() is not None
    assert figure.axes[-1].get_xlabel()
    return figure
