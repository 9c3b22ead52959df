"""Data frames and ParaView files."""

import sys

import numpy as np
import pytest
from looked_at import BAR, STRIP, run
from meshio.xdmf import TimeSeriesReader

from buckler import mbs


def test_a_data_frame_has_time_as_its_index():
    pytest.importorskip("pandas")
    result = run("failed")
    frame = result.to_dataframe()
    assert frame.index.name == "t" and (frame["A.x"].to_numpy() == result.signals["A.x"]).all()
    assert frame.attrs["units"]["A.x"] == "m" and frame.attrs["status"] == "TOO_MANY_STEPS"


def test_a_missing_library_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match=r"to_dataframe needs pandas: pip install 'buckler\[tables\]'"):
        run("strip").to_dataframe()


def opened(path):
    """Times, places (times, nodes, 3), cells by kind and point data of each time, as meshio's reader has them."""
    with TimeSeriesReader(path) as reader:
        points, cells = reader.read_points_cells()
        times, data = [], []
        for k in range(reader.num_steps):
            t, found, _ = reader.read_data(k)
            times.append(t)
            data.append(found)
    moved = np.array([points + each["displacement"] for each in data])
    kinds = {}
    for block in cells:
        kinds.setdefault(block.type, []).append(block.data)
    return times, moved, {kind: np.concatenate(blocks) for kind, blocks in kinds.items()}, data


def volume(places, cells):
    """Sum over cells, by tetrahedra from their first corner; hexahedra by five, wedges by three."""
    cut = {
        8: ((0, 1, 3, 4), (1, 2, 3, 6), (1, 4, 5, 6), (3, 4, 6, 7), (1, 3, 4, 6)),
        6: ((0, 1, 2, 5), (0, 1, 5, 4), (0, 4, 5, 3)),
    }
    p, total = places[cells], 0.0
    for a, b, c, d in cut[cells.shape[1]]:
        total += np.einsum("ij,ij->i", np.cross(p[:, b] - p[:, a], p[:, c] - p[:, a]), p[:, d] - p[:, a]).sum() / 6
    return abs(total)


def test_paraview_shows_links_in_their_true_size(tmp_path):
    result = run("strip")
    times, places, cells, data = opened(result.write_paraview(tmp_path / "out" / "run.xdmf", [0.0, 2.5]))
    assert times == [0.0, 2.5]
    for moved in places:
        strip = moved[np.unique(cells["hexahedron"])]
        assert volume(moved, cells["hexahedron"]) == pytest.approx(0.31 * STRIP.area, rel=2e-3)
        assert np.ptp(strip[:, 2]) == pytest.approx(0.030)
    assert abs(data[1]["curvature"]).max() == pytest.approx(abs(result.movie.bands["coupler"].bending).max(), rel=0.01)
    assert data[1]["axial_force"].min() < -1.0
    assert set(data[0]["link"]) == {0, 1}


def test_paraview_turns_a_rigid_link_as_it_is(tmp_path):
    """A capsule of the section's thickness between its ends, of the section's width."""
    bar = mbs.Mechanism(
        points={"O": (0.0, 0.0), "A": (0.2, 0.0)},
        links=[mbs.Link("bar", "O", "A", BAR)],
        joints=[mbs.Revolute("O", "ground", "bar")],
        drives=[mbs.Drive("bar", np.pi / 2)],
    )
    _, places, cells, _ = opened(mbs.simulate(bar, 1.0).write_paraview(tmp_path / "bar.xdmf", [0.0, 1.0]))
    for moved in places:
        exact = (0.2 * 0.010 + np.pi * 0.005**2) * 0.020
        assert volume(moved, cells["wedge"]) == pytest.approx(exact, rel=5e-3)
    assert places[1].mean(axis=0) == pytest.approx([0.0, 0.1, 0.0], abs=1e-8)


@pytest.mark.parametrize("name", ["loose", "strut", "loaded", "failed", "modal"])
def test_paraview_takes_every_kind(name, tmp_path):
    result = run(name)
    _, places, cells, data = opened(result.write_paraview(tmp_path / "run.xdmf", [0.0, 0.01]))
    assert sum(map(len, cells.values())) > 3 and np.isfinite(places).all()
    assert len(set(data[0]["link"])) == len(result.film.record.mechanism.links)


def test_paraview_by_default_takes_the_times_of_the_movie(tmp_path):
    result = run("pendulum")
    assert opened(result.write_paraview(tmp_path / "run.xdmf"))[0] == result.movie.time.tolist()
    with pytest.raises(ValueError, match=r"must end in .xdmf"):
        result.write_paraview(tmp_path / "folder")
