"""What a notebook shows of a mechanism: its picture and its parts."""

from __future__ import annotations

import html
import re
from io import StringIO

from buckler.mbs.elements.element import Element
from buckler.mbs.elements.link import Link
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.view.movie import still
from buckler.mbs.view.plot import draw
from buckler.mbs.view.style import house_style


def mechanism_html(mechanism: Mechanism) -> str:
    """Picture (SVG) and a table of the elements."""
    from matplotlib.figure import Figure

    text = StringIO()
    with house_style():
        figure = Figure(figsize=(6.3, 4.0))
        draw(still(mechanism), 0, figure.subplots())
        figure.savefig(text, format="svg", bbox_inches="tight", metadata={"Date": None})
    picture = re.sub(r"^.*?(?=<svg)", "", text.getvalue(), flags=re.DOTALL)
    cells = [(html.escape(name), html.escape(kind(element))) for name, element in mechanism.elements().items()]
    rows = "".join(f"<tr><td>{name}</td><td>{what}</td></tr>" for name, what in cells)
    return f"<div>{picture}<table><thead><tr><th>element</th><th>kind</th></tr></thead><tbody>{rows}</tbody></table></div>"


def kind(element: Element) -> str:
    """Kind of an element; of a link, that of its body too."""
    return type(element).__name__ + (f" ({type(element.body).__name__})" if isinstance(element, Link) else "")
