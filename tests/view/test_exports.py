"""Tables and ParaView files."""

import csv
import warnings
import xml.etree.ElementTree as ET

import meshio
import numpy as np
import pytest
from looked_at import STRIP, run


def test_csv_keeps_every_bit(tmp_path):
    result = run("strip")
    with open(result.write_csv(tmp_path / "deep" / "run.csv"), newline="") as file:
        head, *rows = csv.reader(file)
    assert head[0] == "t [s]" and head[1 + list(result.signals).index("B.contact_force")] == "B.contact_force [N]"
    table = np.array(rows, dtype=float)
    assert (table[:, 0] == result.time).all()
    assert (table[:, 1:] == np.column_stack(list(result.signals.values()))).all()


def test_parquet_keeps_values_and_units(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    result = run("strip")
    table = parquet.read_table(result.write_parquet(tmp_path / "run.parquet"))
    assert (table.column("B.x").to_numpy() == result.signals["B.x"]).all()
    assert table.schema.field("B.contact_force").metadata == {b"unit": b"N"}
    assert table.schema.metadata[b"status"] == b"OK"


def test_a_data_frame_has_time_as_its_index():
    pytest.importorskip("pandas")
    result = run("failed")
    frame = result.to_dataframe()
    assert frame.index.name == "t" and (frame["A.x"].to_numpy() == result.signals["A.x"]).all()
    assert frame.attrs["units"]["A.x"] == "m" and frame.attrs["status"] == "TOO_MANY_STEPS"


def test_a_data_set_has_units():
    pytest.importorskip("xarray")
    data = run("strip").to_xarray()
    assert data["B.contact_force"].attrs["units"] == "N" and data["B.contact_force"].dims == ("t",)


def test_a_missing_library_is_named(monkeypatch):
    import sys

    for name in ("pandas", "xarray"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ImportError, match=r"to_dataframe needs pandas: pip install 'buckler\[tables\]'"):
        run("strip").to_dataframe()
    with pytest.raises(ImportError, match="to_xarray needs xarray"):
        run("strip").to_xarray()


def files_of(collection, name):
    entries = [entry for entry in ET.parse(collection).getroot().iter("DataSet") if entry.get("name") == name]
    return [float(entry.get("timestep")) for entry in entries], [collection.parent / entry.get("file") for entry in entries]


def volume(mesh):
    """Of all hexahedra, by five tetrahedra each."""
    p = mesh.points[next(block.data for block in mesh.cells if block.type == "hexahedron")]
    total = 0.0
    for a, b, c, d in ((0, 1, 3, 4), (1, 2, 3, 6), (1, 4, 5, 6), (3, 4, 6, 7), (1, 3, 4, 6)):
        total += np.einsum("ij,ij->i", np.cross(p[:, b] - p[:, a], p[:, c] - p[:, a]), p[:, d] - p[:, a]).sum() / 6
    return total


def test_paraview_shows_links_in_their_true_size(tmp_path):
    result = run("strip")
    times = [0.0, 2.5]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        collection = result.write_paraview(tmp_path / "out", times)
        told, files = files_of(collection, "links")
        meshes = [meshio.read(file) for file in files]
    assert told == times
    for mesh in meshes:
        assert volume(mesh) == pytest.approx(0.31 * STRIP.area, rel=2e-3)
        assert np.ptp(mesh.points[:, 2]) == pytest.approx(0.030)
    bent = meshes[1]
    assert abs(bent.point_data["curvature"]).max() == pytest.approx(abs(result.movie.bands["coupler"].bending).max(), rel=0.01)
    assert bent.point_data["axial_force"].min() < -1.0
    assert set(bent.cell_data["link"][0]) <= {0.0, 1.0}


def test_paraview_shows_a_modal_link_as_its_deformed_solid(tmp_path):
    result = run("modal")
    t = float(result.time[np.argmax(abs(result.signals["rocker.deflection"]))])
    ((file,),) = [files_of(result.write_paraview(tmp_path, [t]), "links")[1]]
    mesh = meshio.read(file)
    assert volume(mesh) == pytest.approx(0.175 * 0.02 * 0.005, rel=1e-6)
    block = next(block.data for block in mesh.cells if block.type == "hexahedron")
    corners = mesh.points[np.unique(block)]
    places = {point: np.array([result.at(f"{point}.{axis}", t) for axis in "xy"]) for point in "BC"}
    for at in places.values():  # the joints lie in the middle of the end faces
        near = corners[np.argsort(np.hypot(*(corners[:, :2] - at).T))[:6], :2]
        assert near.mean(axis=0) == pytest.approx(at, abs=1e-7)
    straight = (places["B"] - places["C"]) / np.hypot(*(places["B"] - places["C"]))
    off = (corners[:, :2] - places["C"]) @ (-straight[1], straight[0])
    middle = abs((corners[:, :2] - places["C"]) @ straight - 0.0875) < 1e-3
    assert off[middle].mean() == pytest.approx(result.at("rocker.deflection", t), rel=0.02)


def test_paraview_shows_forces_as_vectors(tmp_path):
    result = run("strip")
    collection = result.write_paraview(tmp_path, [2.5])
    ((file,),) = [files_of(collection, "forces")[1]]
    mesh = meshio.read(file)
    assert b'format="appended"' in file.read_bytes()
    at = np.array([result.at("B.x", 2.5), result.at("B.y", 2.5)])
    k = int(np.argmin(np.hypot(*(mesh.points[:, :2] - at).T)))
    assert mesh.point_data["force"][k] == pytest.approx(np.array([result.at("B.contact_force", 2.5), 0.0, 0.0]), rel=1e-6)


@pytest.mark.parametrize("name", ["modal", "loose", "pendulum", "strut", "loaded", "failed"])
def test_paraview_takes_every_kind(name, tmp_path):
    collection = run(name).write_paraview(tmp_path, [0.0, 0.01])
    for part in ("links", "symbols"):
        for file in files_of(collection, part)[1]:
            assert len(meshio.read(file).points) > 3


def test_paraview_by_default_takes_the_times_of_the_movie(tmp_path):
    result = run("pendulum")
    assert files_of(result.write_paraview(tmp_path), "links")[0] == result.movie.time.tolist()
