"""How the figures of studies are tested."""

from buckler.studies.kit.style import house_style


def drawn(study, result):
    """The figure of a result: every axis named, and nothing warned about."""
    with house_style():
        figure = study.figure(result)
        figure.canvas.draw()
    for ax in figure.axes:
        assert ax.get_ylabel()
        assert ax.get_legend() is not None
    assert figure.axes[-1].get_xlabel()
    return figure
