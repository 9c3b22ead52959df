"""The shell of all pages, one file, no network, with its data, styles and script inside; and the page of a fit."""

from __future__ import annotations

import html
import json
from functools import cache
from importlib.resources import files
from io import StringIO
from pathlib import Path
from typing import Any

from ..units import label_with_unit
from .style import house_style, subplots

HERE = "buckler.mbs.view"


def fill_page(package: str, name: str, content: dict[str, Any]) -> str:
    """Return a page as text.

    Parameters
    ----------
    package, name : str
        Whose `page/name.html`, `.css` and `.js` make it; styles and script of the run's report come before its own, and the
        report's body stands where its own has `{{report}}`.
    content : dict
        Its data, with `title` and `status`, which the title of the window tells unless it is OK.
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


MOST = 12
"""Experiments that are drawn."""


def write_fit(fit: Any, path: str | Path, title: str) -> Path:
    """Write the page of a fit."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page(fit, title), encoding="utf-8")
    return path


def page(fit: Any, title: str) -> str:
    """Return that page as text."""
    rows = "".join(
        f"<tr><td>{html.escape(label_with_unit(name, fit.units[name]))}</td><td>{value:.6g}</td><td>{fit.intervals[name].low:.6g}"
        f" to {fit.intervals[name].high:.6g}</td><td>{fit.free[name][0]:.6g} to {fit.free[name][1]:.6g}</td></tr>"
        for name, value in fit.values.items()
    )
    left = "".join(
        f"<p>rms of what is left of {html.escape(label_with_unit(name, fit.units[name]))}: {value:.4g}</p>"
        for name, value in fit.rms.items()
    )
    told = left + "".join(f'<p class="doubt">{html.escape(each)}</p>' for each in fit.unidentified)
    readings = "".join(
        f"<tr><td>{html.escape(f'{each.name} {text}'.strip())}</td>"
        f"<td>{read.side} {read.value:.6g} ± {read.error:.2g}</td><td>{said[text]:.6g}</td></tr>"
        for each, said in zip(fit.experiments, fit.predicted, strict=True)
        for text, read in each.readings.items()
    )
    with house_style():
        drawn = "".join(_svg(figure) for figure in (*_signals(fit), *_profiles(fit)))
    heading = html.escape(title)
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><title>{heading}</title>'
        f"<style>{_part('buckler.mbs.view', 'report.css')}\nbody{{padding:1.5rem}} td,th{{padding:.15rem .8rem;text-align:left}}"
        f"td:first-child{{white-space:normal;overflow-wrap:anywhere}}"
        f"svg{{max-width:100%;height:auto}}</style></head><body><h1>{heading}</h1>"
        f"<table><tr><th>number</th><th>value</th><th>95 % interval</th><th>range</th></tr>{rows}</table>{told}"
        + (f"<h2>Readings</h2><table><tr><th></th><th>measured</th><th>fit</th></tr>{readings}</table>" if readings else "")
        + f"{drawn}</body></html>\n"
    )


def _signals(fit: Any) -> list[Any]:
    """Data beside the fit, and what is left, one figure an experiment."""
    figures = []
    for each, said in list(zip(fit.experiments, fit.predicted, strict=True))[:MOST]:
        names = list(each.signals)
        if not names:
            continue
        figure, axes = subplots(len(names), 2, height=20.0 + 45.0 * len(names), squeeze=False, sharex=True)
        for name, (left, right) in zip(names, axes, strict=True):
            left.plot(each.time, each.signals[name], ".", markersize=2, label="data")
            left.plot(each.time, said[name], label="fit")
            right.plot(each.time, each.signals[name] - said[name], ".", markersize=2)
            left.set_ylabel(label_with_unit(name, fit.units[name]))
            right.set_ylabel(label_with_unit("data less fit", fit.units[name]))
        axes[0, 0].set_title(each.name or "experiment")
        axes[0, 0].legend()
        for ax in axes[-1]:
            ax.set_xlabel("time [s]")
        figures.append(figure)
    return figures


def _profiles(fit: Any) -> list[Any]:
    """Least cost over each number that was asked for, and the cost at which its interval ends."""
    if not fit.profiles:
        return []
    figure, axes = subplots(1, len(fit.profiles), height=60, squeeze=False)
    for ax, (name, profile) in zip(axes[0], fit.profiles.items(), strict=True):
        ax.plot(profile.at, profile.cost, "o-", markersize=3)
        ax.axhline(profile.level, linestyle="--", label="end of the 95 % interval")
        ax.legend()
        ax.set(
            xlabel=label_with_unit(name, fit.units[name]),
            ylabel="half the sum of squares",
            ylim=(None, profile.cost.min() + 4 * (profile.level - profile.cost.min())),
        )
        ax.xaxis.get_major_locator().set_params(nbins=4)
    return [figure]


def _svg(figure: Any) -> str:
    """Return a figure as text for a page."""
    text = StringIO()
    figure.savefig(text, format="svg")
    return f"<figure>{text.getvalue()[text.getvalue().index('<svg') :]}</figure>"
