"""Pictures by matplotlib: a mechanism, signals over time, the energy ledger, an animation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path as FilePath
from shutil import which
from typing import Any

import numpy as np

from buckler.mbs.geometry import Array
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.units import labelled
from buckler.mbs.validate import near
from buckler.mbs.view.drawing import INKS, Arrow, Disc, Label, Mark, Path, Span, Strip
from buckler.mbs.view.movie import Movie, placed, still

MARGIN = 4.0
"""Room around a mechanism, in symbols."""
FRAMES = 120
"""Pictures of an animation at most."""


def plot_mechanism(mechanism: Mechanism, axes: Any = None, names: bool = True) -> Any:
    """Draw a mechanism at t = 0; see `Mechanism.plot`."""
    return draw(still(mechanism), 0, axes, names)


def draw(movie: Movie, k: int, axes: Any = None, names: bool = True) -> Any:
    """Draw picture number k of a movie.

    Parameters
    ----------
    movie : Movie
    k : int
    axes : matplotlib Axes, optional
        Where to draw; a new figure by default.
    names : bool
        Write the names of links and points.

    Returns
    -------
    axes : matplotlib Axes
    """
    from buckler.mbs.view.style import house_style

    with house_style():
        axes = _axes(axes, movie)
        for mark in movie.marks:
            if not isinstance(mark, Arrow) and (names or not isinstance(mark, Label)):
                _Drawn(axes, mark).move(movie, k)
        _frame_axes(axes, movie)
    return axes


def _axes(axes: Any, movie: Movie) -> Any:
    """Those given, or new ones about as high as the mechanism."""
    if axes is not None:
        return axes
    import matplotlib.pyplot as plt

    from buckler.mbs.view.style import WIDTH

    left, right, low, high = movie.box
    room = 2 * MARGIN * movie.unit
    height = float(np.clip(WIDTH * (high - low + room) / (right - left + room) + 15.0, 0.25 * WIDTH, WIDTH))
    return plt.subplots(figsize=(WIDTH / 25.4, height / 25.4), layout="constrained")[1]


def _frame_axes(axes: Any, movie: Movie) -> None:
    """Equal scales, room for symbols, axes in m."""
    left, right, low, high = movie.box
    room = MARGIN * movie.unit
    axes.set(xlim=(left - room, right + room), ylim=(low - room, high + room), xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.grid(False)


class _Drawn:
    """One mark on some axes, which can be moved to any picture of a movie."""

    def __init__(self, axes: Any, mark: Mark) -> None:
        self.mark, ink = mark, INKS.get(getattr(mark, "ink", "other"), INKS["other"])
        paint = {"edgecolor": ink.line, "facecolor": ink.fill or "none", "linewidth": ink.width}
        line = {"color": ink.line, "linewidth": ink.width, "solid_capstyle": "round", "solid_joinstyle": "round"}
        if isinstance(mark, Path) and mark.closed:
            from matplotlib.patches import Polygon

            self.artist: Any = axes.add_patch(Polygon(np.zeros((3, 2)), closed=True, zorder=2, **paint))
        elif isinstance(mark, Disc):
            from matplotlib.patches import Circle

            self.artist = axes.add_patch(Circle((0, 0), mark.radius, zorder=3, **paint))
        elif isinstance(mark, Label):
            colour, size = ("#1B2733", 9.0) if mark.what == "point" else ("#4B5560", 8.0)
            self.artist = axes.text(0, 0, mark.text, color=colour, fontsize=size, ha="center", va="center", zorder=5)
            if mark.what == "link":
                self.artist.set_bbox({"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.8})
        else:
            (self.artist,) = axes.plot([], [], zorder=2, **line)
            if isinstance(mark, Strip):
                self.artist.set_linewidth(2.0)

    def move(self, movie: Movie, k: int) -> None:
        """Put it where it is in picture k."""
        mark, artist = self.mark, self.artist
        if isinstance(mark, Disc):
            artist.center = placed(movie.frames[mark.frame][k], [mark.centre])[0]
        elif isinstance(mark, Label):
            artist.set_position(placed(movie.frames[mark.frame][k], [mark.place])[0])
        elif isinstance(mark, Path) and mark.closed:
            artist.set_xy(placed(movie.frames[mark.frame][k], mark.points))
        elif isinstance(mark, Path):
            artist.set_data(*placed(movie.frames[mark.frame][k], mark.points).T)
        elif isinstance(mark, Strip):
            artist.set_data(*movie.bands[mark.link].points[k].T)
        elif isinstance(mark, Span):
            artist.set_data(*_stretched(movie, mark, k).T)


def _stretched(movie: Movie, mark: Span, k: int) -> Array:
    a, b = movie.frames[mark.frame][k, :2], movie.frames[mark.other][k, :2]
    along = b - a
    left = np.array([-along[1], along[0]]) / max(np.hypot(*along), 1e-300)
    points = np.array(mark.points)
    return np.asarray(a + points[:, :1] * along + points[:, 1:] * left)


# --- signals ----------------------------------------------------------------------------------------------------------


def plot_signals(result: Any, names: Sequence[str], axes: Any = None) -> Any:
    """Draw signals over time, one row for each unit; see `Result.plot`."""
    from buckler.mbs.view.style import house_style

    if not names:
        raise ValueError("plot: name one signal at least, as in result.plot('B.x')")
    for name in names:
        if name not in result.signals:
            close = ", ".join(near(name, result.signals, 4, 0.3)) or ", ".join(list(result.signals)[:8])
            raise ValueError(f"unknown signal '{name}'; near: {close}")
    units = list(dict.fromkeys(result.units[name] for name in names))
    with house_style():
        rows = _rows(axes, len(units))
        for row, unit in zip(rows, units, strict=True):
            shown = [name for name in names if result.units[name] == unit]
            for name in shown:
                row.plot(result.time, result.signals[name], label=name)
            row.set_ylabel(labelled(shown[0] if len(shown) == 1 else "", unit).strip())
            if len(shown) > 1:
                row.legend()
        rows[-1].set_xlabel("time [s]")
        _warn(rows[0], result)
    return rows[0] if len(rows) == 1 else np.array(rows)


def plot_energy(result: Any, axes: Any = None) -> Any:
    """Draw the energy ledger over time; see `Result.plot_energy`."""
    from buckler.mbs.view.style import house_style

    if not result.energy:
        raise ValueError("no energy ledger: call simulate(..., ledger=True)")
    with house_style():
        (axes,) = _rows(axes, 1)
        for name, values in result.energy.items():
            if "." in name or name in ("throughput", "error") or not np.any(values):
                continue
            dashes = "--" if name.startswith("taken_") else ":" if name.startswith("given_") else "-"
            axes.plot(result.time, values, dashes, label=name.replace("taken_", "taken by ").replace("given_", "given by "))
        axes.plot(result.time, result.energy["error"], color="#B3261E", linewidth=2.0, label="error of the balance")
        axes.set(xlabel="time [s]", ylabel="energy [J]")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        _warn(axes, result)
    return axes


def _rows(axes: Any, count: int) -> list[Any]:
    if axes is not None:
        return list(np.atleast_1d(axes))
    import matplotlib.pyplot as plt

    from buckler.mbs.view.style import WIDTH

    size = (WIDTH / 25.4, (30 + 50 * count) / 25.4)
    return list(plt.subplots(count, 1, figsize=size, sharex=True, squeeze=False, layout="constrained")[1][:, 0])


def _warn(axes: Any, result: Any) -> None:
    """Say above a picture that its run is not to be trusted."""
    if not result.ok:
        axes.set_title(f"\u25b2 {result.status}: do not trust these values", color="#B3261E", loc="left")


# --- animation --------------------------------------------------------------------------------------------------------


def animate(movie: Movie, path: str | FilePath, seconds: float = 6.0, width: float = 640.0) -> FilePath:
    """Write a moving picture; see `Result.animate`."""
    path = FilePath(path)
    kind = path.suffix.lower()
    if kind not in (".gif", ".mp4"):
        raise ValueError(f"animate: '{path.name}' must end in .gif or .mp4")
    if kind == ".mp4" and which("ffmpeg") is None:
        raise RuntimeError(f"animate: '{path.name}' needs the program ffmpeg, which was not found; install it, or write a .gif")
    chosen = np.unique(np.linspace(0, len(movie.time) - 1, min(FRAMES, len(movie.time))).round().astype(int))
    rate = max(1.0, len(chosen) / seconds)
    path.parent.mkdir(parents=True, exist_ok=True)
    pictures = _pictures(movie, chosen, width)
    (_write_gif if kind == ".gif" else _write_mp4)(path, pictures, rate)
    return path


def _pictures(movie: Movie, chosen: Array, width: float) -> Iterator[Array]:
    """Pictures as arrays (height, width, 3) of bytes, with even numbers of pixels."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from buckler.mbs.view.style import house_style

    left, right, low, high = movie.box
    room = 2 * MARGIN * movie.unit
    height = 2 * round(float(np.clip(width * (high - low + room) / (right - left + room), 0.3 * width, 1.2 * width)) / 2)
    with house_style():
        figure = Figure(figsize=(width / 100, height / 100), dpi=100)
        canvas = FigureCanvasAgg(figure)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        drawn = [_Drawn(axes, mark) for mark in movie.marks if not isinstance(mark, Arrow | Label)]
        _frame_axes(axes, movie)
        axes.set_axis_off()
        clock = axes.text(0.02, 0.97, "", transform=axes.transAxes, va="top", fontsize=10)
        for k in chosen:
            for mark in drawn:
                mark.move(movie, int(k))
            clock.set_text(f"t = {movie.time[k]:.3f} s")
            canvas.draw()
            yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _write_gif(path: FilePath, pictures: Iterator[Array], rate: float) -> None:
    """One palette for all pictures, so that only what changes is stored."""
    from PIL import Image

    whole = [Image.fromarray(picture) for picture in pictures]
    palette = whole[len(whole) // 2].quantize(64)
    first, *others = (picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in whole)
    first.save(path, save_all=True, append_images=others, duration=round(1000 / rate), loop=0, optimize=True)


def _write_mp4(path: FilePath, pictures: Iterator[Array], rate: float) -> None:
    import subprocess

    first = next(pictures)
    size = f"{first.shape[1]}x{first.shape[0]}"
    command = ["ffmpeg", "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", f"{rate:g}"]
    command += ["-i", "-"]
    even = "crop=trunc(iw/2)*2:trunc(ih/2)*2"  # the codec wants even sizes
    command += ["-an", "-vf", even, "-c:v", "libx264", "-pix_fmt", "yuv420p", str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin is not None
        for picture in chain([first], pictures):
            process.stdin.write(picture.tobytes())
        _, said = process.communicate()
    if process.returncode:
        raise RuntimeError(f"animate: ffmpeg failed: {said.decode(errors='replace').strip()[-300:]}")
