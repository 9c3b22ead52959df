"""Pictures by matplotlib: a mechanism, signals over time, the energy ledger, an animation, a fit, a bifurcation diagram."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..geometry import Array
from ..mechanism import Mechanism
from ..record.lookup import unknown
from ..units import label_with_unit
from .drawing import INKS, Arrow, Disc, Label, Mark, Outline, StripMark
from .movie import Movie, corners, still
from .style import WIDTH, house_style, subplots

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..record.result import Result


MOST_FRAMES = 120
"""Largest number of pictures of an animation: 20 a second at the default duration of 6 s, chosen."""


def plot_mechanism(mechanism: Mechanism, axes: Axes | None = None, names: bool = True) -> Axes:
    """Draw a mechanism at t = 0; see `Mechanism.plot`."""
    return draw(still(mechanism), 0, axes, names)


def draw(movie: Movie, k: int, axes: Axes | None = None, names: bool = True) -> Axes:
    """Draw picture number k of a movie on axes, by default new ones, with or without the names of links and points."""
    with house_style():
        if axes is None:
            import matplotlib.pyplot as plt

            left, right, low, high = _limits(movie)
            height = WIDTH * (high - low) / (right - left) + 15.0  # [mm], 15 of them for the text
            height = float(np.clip(height, 0.25 * WIDTH, WIDTH))
            axes = plt.subplots(figsize=(WIDTH / 25.4, height / 25.4), layout="constrained")[1]
        omitted = (Arrow,) if names else (Arrow, Label)  # an `Arrow` needs the values of signals, as on a report page
        for mark in movie.marks:
            if not isinstance(mark, omitted):
                move = _add_artist(axes, mark)
                move(corners(movie, mark, k))
        _frame_axes(axes, movie)
    return axes


def _limits(movie: Movie) -> tuple[float, float, float, float]:
    """Return the limits of a picture, of x, then y [m]: those of the mechanism and a margin of four symbol sizes."""
    left, right, low, high = movie.box
    gap = 4 * movie.unit  # the size of a symbol [m]
    return left - gap, right + gap, low - gap, high + gap


def _frame_axes(axes: Axes, movie: Movie) -> None:
    left, right, low, high = _limits(movie)
    axes.set(xlim=(left, right), ylim=(low, high), xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.grid(False)


def _add_artist(axes: Axes, mark: Mark) -> Callable[[Array], object]:
    """Add a mark to axes; return the function that moves it to its corners in a picture."""
    from matplotlib.patches import Polygon

    if isinstance(mark, Label):
        colour, size = ("#1B2733", 9.0) if mark.what == "point" else ("#4B5560", 8.0)
        text = axes.text(0, 0, mark.text, color=colour, fontsize=size, ha="center", va="center", zorder=5)
        if mark.what == "link":
            text.set_bbox({"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.8})
        return lambda corners: text.set_position(corners[0])
    ink = INKS.get(mark.ink, INKS["other"])
    if isinstance(mark, Disc) or (isinstance(mark, Outline) and mark.closed):
        colours: dict[str, Any] = {"edgecolor": ink.line, "facecolor": ink.fill or "none", "linewidth": ink.width}
        outline = Polygon(np.zeros((3, 2)), closed=True, zorder=3 if isinstance(mark, Disc) else 2, **colours)
        axes.add_patch(outline)
        return outline.set_xy
    width = 2.0 if isinstance(mark, StripMark) else ink.width
    style: dict[str, Any] = {"color": ink.line, "solid_capstyle": "round", "solid_joinstyle": "round"}
    (line,) = axes.plot([], [], zorder=2, linewidth=width, **style)
    return lambda corners: line.set_data(*corners.T)


def plot_signals(result: Result, names: Sequence[str], axes: Axes | Sequence[Axes] | None = None) -> Axes | Array:
    """Draw signals over time, one row for each unit; see `Result.plot`."""
    if not names:
        raise ValueError("plot: name one signal at least, as in result.plot('B.x')")
    for name in names:
        if name not in result.signals:
            raise unknown(name, list(result.signals))
    units = list(dict.fromkeys(result.units[name] for name in names))
    with house_style():
        rows = _rows(axes, len(units))
        for row, unit in zip(rows, units, strict=True):
            shown = [name for name in names if result.units[name] == unit]
            for name in shown:
                row.plot(result.time, result.signals[name], label=name)
            row.set_ylabel(label_with_unit(shown[0] if len(shown) == 1 else "", unit).strip())
            if len(shown) > 1:
                row.legend()
        rows[-1].set_xlabel("time [s]")
        _warn(rows[0], result)
    return rows[0] if len(rows) == 1 else np.array(rows)


def plot_energy(result: Result, axes: Axes | None = None) -> Axes:
    """Draw the energy ledger over time; see `Result.plot_energy`."""
    if not result.energy:
        raise ValueError("no energy ledger: call simulate(..., ledger=True)")
    with house_style():
        (axes,) = _rows(axes, 1)
        for name, values in result.energy.items():
            is_of_one_joint = "." in name  # as `B.taken_contact`, part of the sum `taken_contact`
            if is_of_one_joint or name in ("throughput", "error") or not np.any(values):
                continue
            dashes = "--" if name.startswith("taken_") else ":" if name.startswith("given_") else "-"
            axes.plot(result.time, values, dashes, label=name.replace("taken_", "taken by ").replace("given_", "given by "))
        axes.plot(result.time, result.energy["error"], color="#B3261E", linewidth=2.0, label="error of the balance")
        axes.set(xlabel="time [s]", ylabel="energy [J]")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        _warn(axes, result)
    return axes


def _rows(axes: Axes | Sequence[Axes] | None, count: int) -> list[Axes]:
    """Return given axes as a list, or make a figure with a column of `count` axes."""
    if axes is not None:
        return list(axes) if isinstance(axes, Iterable) else [axes]
    import matplotlib.pyplot as plt

    size = (WIDTH / 25.4, (30 + 50 * count) / 25.4)  # mm to inches
    return list(plt.subplots(count, 1, figsize=size, sharex=True, squeeze=False, layout="constrained")[1][:, 0])


def _warn(axes: Axes, result: Result) -> None:
    """Write a warning above a picture if its run failed or is suspect."""
    if not result.ok:
        axes.set_title(f"\u25b2 {result.status}: do not trust these values", color="#B3261E", loc="left")


def animate(movie: Movie, path: str | Path, seconds: float = 6.0, width: float = 640.0) -> Path:
    """Write a movie as an animated GIF of some seconds, `width` pixels wide; see `Result.animate`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from PIL import Image

    path = Path(path)
    if path.suffix != ".gif":
        raise ValueError(f"animate: '{path.name}' must end in .gif")
    rows = np.unique(np.linspace(0, len(movie.time) - 1, min(MOST_FRAMES, len(movie.time))).round().astype(int)).tolist()
    rate = max(1, round(len(rows) / seconds))
    path.parent.mkdir(parents=True, exist_ok=True)
    left, right, low, high = _limits(movie)
    height = round(float(np.clip(width * (high - low) / (right - left), 0.3 * width, 1.2 * width)))
    images = []
    with house_style():
        figure = Figure(figsize=(width / 100, height / 100), dpi=100)
        canvas, axes = FigureCanvasAgg(figure), figure.add_axes((0.0, 0.0, 1.0, 1.0))
        artists = [(mark, _add_artist(axes, mark)) for mark in movie.marks if not isinstance(mark, Arrow | Label)]
        _frame_axes(axes, movie)
        axes.set_axis_off()
        clock = axes.text(0.02, 0.97, "", transform=axes.transAxes, va="top", fontsize=10)
        for k in rows:
            for mark, move in artists:
                move(corners(movie, mark, k))
            clock.set_text(f"t = {movie.time[k]:.3f} s")
            canvas.draw()
            images.append(Image.fromarray(np.array(canvas.buffer_rgba())[..., :3]))
    palette = images[len(images) // 2].quantize(64)  # with a common palette, the file stores only what changes
    first, *others = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    first.save(path, save_all=True, append_images=others, duration=round(1000 / rate), loop=0, optimize=True)
    return path


def plot_fit(fit: Any) -> Figure:
    """Draw measured and fitted signals, their differences, and profiles of the likelihood; see `Fit.plot`."""
    pairs = zip(fit.experiments, fit.predicted, strict=True)
    rows = [(each, predicted, name) for each, predicted in pairs for name in each.signals][:12]  # 12 rows at most: chosen
    count = len(rows) + ceil(len(fit.profiles) / 2)
    figure, axes = subplots(count, 2, height=20.0 + 45.0 * count, squeeze=False)
    for (each, predicted, name), (left, right) in zip(rows, axes, strict=False):
        left.plot(each.time, each.signals[name], ".", markersize=2, label="data")
        left.plot(each.time, predicted[name], label="fit")
        left.set(title=each.name, ylabel=label_with_unit(name, fit.units[name]), xlabel="time [s]")
        left.legend()
        right.plot(each.time, each.signals[name] - predicted[name], ".", markersize=2)
        right.set(ylabel=label_with_unit("data less fit", fit.units[name]), xlabel="time [s]")
    for ax, (name, profile) in zip(axes[len(rows) :].flat, fit.profiles.items(), strict=False):
        ax.plot(profile.at, profile.cost, "o-", markersize=3)
        ax.axhline(profile.level, linestyle="--", label="end of the 95 % interval")
        ax.legend()
        least = profile.cost.min()
        top = least + 4 * (profile.level - least)  # the level is at a quarter of the height
        ax.set(xlabel=label_with_unit(name, fit.units[name]), ylabel="half the sum of squares", ylim=(None, top))
    return figure


MARKERS = {"limit": "^", "branching": "s", "flutter": "D", "fold": "^", "doubling": "v"}
"""Markers of critical points, by kind; a fold is the limit point of a path of periodic motions, whose period may double."""


def plot_path(path: Any, link: str, point: str, axis: str | None = None, ax: Any = None) -> Axes:
    """Draw a coordinate of a point over the parameter of a path and its branches: stable parts solid, unstable parts dashed."""
    import matplotlib.pyplot as plt

    ax = plt.subplots(constrained_layout=True)[1] if ax is None else ax
    curves = [path, *getattr(path, "branches", ())]
    # each curve has a pair: places (steps, 2), and places at its critical points; a place of a periodic motion is its amplitude
    ordinates = [curve.ordinates(link, point) for curve in curves]
    axis = axis or "xy"[int(np.ptp(np.vstack([places for places, _ in ordinates]), axis=0).argmax())]
    column = "xy".index(axis)
    for branch, (places, critical_places) in zip(curves, ordinates, strict=True):
        for curve, stable in _pieces(branch, places[:, column]):
            ax.plot(*curve, "C0-" if stable else "C3--", label="stable" if stable else "unstable")
        for critical, place in zip(branch.points, critical_places, strict=True):
            kind, parameter = critical.kind, critical.rest.parameter  # `rest` is the state, also of a periodic motion
            ax.plot(parameter, place[column], MARKERS[kind], color="k", markersize=5, label=kind)
    # `path.ordinate` is the prefix of the axis label: "amplitude of " for periodic motions, else empty
    ax.set(xlabel=path.abscissa, ylabel=f"{path.ordinate}{axis} of {link}:{point} [m]")
    lines, labels = ax.get_legend_handles_labels()
    by_label = dict(zip(labels, lines, strict=True))  # each label once
    ax.legend(by_label.values(), by_label.keys())
    return ax


def _pieces(path: Any, places: Any) -> list[tuple[Any, bool]]:
    """Cut a path of equilibria or periodic motions into curves of parameter and place, (2, points), each with True if stable.

    It is cut at critical points. A critical point C is put between those successive points A, B of the path for which
    |AC| + |CB| - |AB| is smallest. Where stability changes without a critical point, the cut is half-way.
    """
    from scipy.interpolate import CubicSpline

    span = float(np.ptp(path.parameter)) or 1.0
    states = np.column_stack([path.q, path.parameter / span])
    steps = np.linalg.norm(np.diff(states, axis=0), axis=1)
    arc, stable = np.concatenate([[0.0], np.cumsum(steps)]), path.stable
    cuts, cut_steps = list[float](), set[int]()
    for critical in path.points:
        state = np.append(critical.rest.q, critical.rest.parameter / span)
        away = np.linalg.norm(states - state, axis=1)
        k = int(np.argmin(away[:-1] + away[1:] - steps))
        cuts.append(float(np.interp(away[k], [0.0, away[k] + away[k + 1]], arc[k : k + 2])))  # exact at both ends
        cut_steps.add(k)
    is_regular = ~np.isin(arc, cuts)  # False at points that are critical themselves, where a cut lies exactly
    changes = set(np.flatnonzero(stable[1:] != stable[:-1]).tolist())
    cuts += [(arc[k] + arc[k + 1]) / 2 for k in changes - cut_steps]
    curve, pieces = CubicSpline(arc, np.column_stack([path.parameter, places])), list[tuple[Any, bool]]()
    is_stable = False
    for start, end in pairwise(np.unique([arc[0], *cuts, arc[-1]])):
        are_stable = stable[(arc >= start) & (arc <= end) & is_regular]
        # between two critical points without another point of the path, stability is not that of the piece before
        is_stable = bool(are_stable.all()) if len(are_stable) else not is_stable
        pieces.append((curve(np.linspace(start, end, 200)).T, is_stable))
    return pieces
