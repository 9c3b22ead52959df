"""The figure of the design study: what can be had around the design, and what the design does."""

from __future__ import annotations

from dataclasses import replace
from math import degrees, pi
from typing import Any

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch

from buckler.elastica import law
from buckler.mbs.geometry import Array

from ..kit.report import StudyResult
from ..kit.style import Axes, Figure, plain_ticks, subplots
from . import impact
from .inverse import Design, Given, Wish, design
from .inverse_limits import feasible, limits

SHADES = {
    "dead centre": "#bdbdbd", "shortening": "#d9d9d9", "stop": "#c9b8a8", "slenderness": "#e0d4f0", "yield": "#f4b6b0",
    "buckling": "#f5d6a8", "rebound": "#bfe0d2", "rest": "#bcd7ee", "creep": "#e5e5b5", "speed": "#e7c3dc",
    "mass": "#cfcfe8",
}  # fmt: skip
"""Colour of the limit that is broken first."""
CHOSEN: dict[str, Any] = {"color": "#D55E00", "markersize": 7, "markeredgecolor": "white", "linestyle": ""}
POINTS = 300


def draw(result: StudyResult) -> Figure:
    """Draw a result of `buckler.studies.striking.design`."""
    d = designed(result)
    p: Any = result.parameters
    fig, (above, below) = subplots(2, 1, height=165, height_ratios=(1.15, 1))
    _draw_map(above, d, design(p.wish, p.given))
    _draw_turn(below, d, result)
    return fig


def designed(result: StudyResult) -> Design:
    """The design a result is about: the one asked for, or the nearest; the one asked for too where nothing is near."""
    p: Any = result.parameters
    if "wish.contact_force" not in result.metrics:
        return design(p.wish, p.given)
    force, impact, angle = (result.metrics[f"wish.{name}"].value for name in ("contact_force", "impact_force", "contact_angle"))
    return design(Wish(force, impact, np.radians(angle)), p.given)


def _load(shortening: Array) -> Array:
    """Of the elastica; that of ends that meet where they cannot come nearer."""
    return np.asarray(law.fast(np.minimum(shortening, 1.0)))


def _draw_map(ax: Axes, d: Design, asked: Design) -> None:
    """Contact force by lines, the limit that is broken first by colour; speed follows from the impact force everywhere."""
    given, p = d.given, d.wish
    least, most = sorted((d.thickness, np.clip(asked.thickness, d.thickness / 5, 5 * d.thickness)))
    thickness = np.geomspace(least / 2.5, 2.5 * most, POINTS)
    angle = np.linspace(np.radians(4), 2 * pi - np.radians(4), POINTS)
    h, turned = np.meshgrid(thickness, angle)
    stop = given.lengths.slider(pi - turned / 2)
    force = given.lengths.push(_load, given.modulus * d.width * h**3 / 12, pi, stop)
    free = replace(given, thickness=None, width=d.width)
    names = list(SHADES)
    first = np.full(h.shape, len(names))
    for limit in reversed(limits(design(Wish(force, p.impact_force, turned), free))):
        first[np.broadcast_to(limit.use > 1, h.shape)] = names.index(limit.name)
    colours = ListedColormap([*SHADES.values(), "#ffffff"])
    x, y = 1e3 * thickness, np.degrees(angle)
    ax.pcolormesh(x, y, first, cmap=colours, vmin=-0.5, vmax=len(names) + 0.5, shading="nearest", rasterized=True)
    levels = p.contact_force * 2.0 ** np.array([-4, -3, -2, 2, 3, 4])
    lines = ax.contour(x, y, force, levels=levels, colors="#555555", linewidths=0.7)
    ax.clabel(lines, fmt=lambda value: f"{value:.3g} N", fontsize=7)
    for factor, style in ((0.5, ":"), (1.0, "-"), (2.0, "--")):
        ax.contour(x, y, factor * force, levels=[p.contact_force], colors="#000000", linewidths=1.4, linestyles=style)
        ax.plot([], [], style, color="#000000", lw=1.4, label=f"{p.contact_force:.3g} N, width {1e3 * factor * d.width:.3g} mm")
    if not feasible(asked):
        ax.plot(1e3 * asked.thickness, degrees(asked.wish.contact_angle), "X", **CHOSEN, label="asked for")
    if feasible(d):
        ax.plot(1e3 * d.thickness, degrees(p.contact_angle), "o", **CHOSEN, label="design")
    ax.set(xscale="log", xlim=(x[0], x[-1]), ylim=(0, 360), yticks=range(0, 361, 60))
    plain_ticks(ax.xaxis, (1, 1.5, 2, 3, 4, 5, 7))
    ax.grid(False)
    ax.set(xlabel=f"thickness [mm], width {1e3 * d.width:.3g} mm", ylabel="contact angle [deg]")
    _stop_axis(ax, given)
    shown = [Patch(color=SHADES[name], label=name) for i, name in enumerate(names) if np.any(first == i)]
    if np.any(first == len(names)):
        shown.append(Patch(facecolor="#ffffff", edgecolor="#bbbbbb", linewidth=0.6, label="can be had"))
    handles = [*ax.get_legend_handles_labels()[0], *shown]
    small = {"fontsize": 7, "columnspacing": 1.0, "handlelength": 1.6}
    ax.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=5, **small)


def _stop_axis(ax: Axes, given: Given) -> None:
    """The place of the stop, at the contact angles on the left."""
    twin = ax.twinx()
    angle = np.array(ax.get_yticks())
    twin.set(ylim=ax.get_ylim(), yticks=angle, ylabel="stop before the crank pivot [mm]")
    twin.set_yticklabels([f"{-1e3 * x:.0f}" for x in given.lengths.slider(pi - np.radians(angle) / 2)])
    twin.grid(False)


def _draw_turn(ax: Axes, d: Design, result: StudyResult) -> None:
    """Force on the stop over crank angle: simulated, exact, and what was asked for."""
    half = d.wish.contact_angle / 2
    angle = np.linspace(pi - half, pi + half, 400)
    rigidity = d.euler_load * (d.given.coupler / pi) ** 2
    exact = d.given.lengths.push(_load, rigidity, angle, d.stop - d.wish.contact_force / d.stiffness)
    floor = exact.min() / 4
    for model in ("beam", "strut"):
        if f"{model}.angle" in result.signals:
            turned, force = np.degrees(result.signals[f"{model}.angle"]), result.signals[f"{model}.force"]
            impact.draw_force(ax, turned, force, model, floor, linewidth=1.0)
    ax.semilogy(np.degrees(angle), exact, "--", color="#000000", lw=1.0, label="elastica at rest")
    ax.plot(180, d.wish.contact_force, "o", color="#009E73", label=f"contact wished, {d.wish.contact_force:.3g} N")
    ax.axhline(d.wish.impact_force, color="#009E73", linestyle=":", label=f"impact wished, {d.wish.impact_force:.3g} N")
    ax.axvspan(180 - degrees(half), 180 + degrees(half), color="#009E73", alpha=0.08, lw=0, label="contact angle wished")
    margin = max(4.0, 0.08 * degrees(half))
    ax.set(xlim=(180 - degrees(half) - margin, 180 + degrees(half) + margin), xlabel="crank angle [deg]")
    impact.frame_force(ax, floor, 6)
    ax.legend(loc="upper right", ncols=3, fontsize=7)
    if not feasible(d):
        ax.set_title("no wish like this can be had")
