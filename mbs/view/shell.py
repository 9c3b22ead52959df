"""The shell of all pages, one file, no network, with its data, styles and script inside."""

from __future__ import annotations

import html
import json
from functools import cache
from importlib.resources import files
from typing import Any

HERE = "buckler.mbs.view"


def fill_page(package: str, name: str, content: dict[str, Any]) -> str:
    """Return a page as text, of `page/name.html`, `.css` and `.js` of a package, with its data, among them `title` and `status`.

    Styles and script of the run's report come before its own; the report's body stands where its own has `{{report}}`. The title
    of the window tells the status unless it is OK.
    """
    mark = "" if content["status"] == "OK" else f"\u25b2 {content['status']}: "
    both = [(HERE, "report"), *([] if (package, name) == (HERE, "report") else [(package, name)])]
    parts = {
        "title": html.escape(mark + content["title"]),
        "styles": "".join(_part(where, f"{part}.css") for where, part in both),
        "body": _part(package, f"{name}.html").replace("{{report}}", _part(HERE, "report.html")),
        "script": "".join(_part(where, f"{part}.js") for where, part in both),
        "data": json.dumps(content, separators=(",", ":"), allow_nan=False, default=str).replace("<", "\\u003c"),
    }
    text = _part(HERE, "shell.html")
    for key, part in parts.items():
        text = text.replace("{{" + key + "}}", part)
    return text


@cache
def _part(package: str, name: str) -> str:
    return files(package).joinpath("page", name).read_text(encoding="utf-8")
