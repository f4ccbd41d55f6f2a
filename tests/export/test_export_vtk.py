"""The series for ParaView: read back by a parser of our own and, where it is there, by VTK itself."""

import base64
import zlib
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

from ploughval.axes import Status
from ploughval.export import export_results

TYPES = {"Float64": "<f8", "Int64": "<i8"}


@pytest.fixture(scope="module")
def written(folder, tmp_path_factory):
    return export_results(folder, "vtk", tmp_path_factory.mktemp("vtk"))[0].parent


def decoded(element):
    """The numbers of a DataArray: 4 head words in base64, then a packed block in base64."""
    text, head_signs = element.text.strip(), 44
    blocks, size, _, packed = np.frombuffer(
        base64.b64decode(text[:head_signs]) if len(text) > 32 else bytes(32), "<u8"
    )
    raw = zlib.decompress(base64.b64decode(text[head_signs:])) if blocks else b""
    assert len(raw) == size
    assert blocks == 0 or len(base64.b64decode(text[head_signs:])) == packed
    values = np.frombuffer(raw, TYPES[element.get("type")])
    return values.reshape(-1, int(element.get("NumberOfComponents", "1")))


def read(path):
    """Arrays of a .vtp file by the place in which they stand and their name."""
    root = ElementTree.parse(path).getroot()
    arrays = {
        (place, array.get("Name")): decoded(array)
        for place in ("FieldData", "Points", "Verts", "Lines", "PointData", "CellData")
        for array in root.iterfind(f".//{place}/DataArray")
    }
    piece = root.find(".//Piece")
    assert len(arrays["Points", "Points"]) == int(piece.get("NumberOfPoints"))
    return arrays


def steps(path):
    """Files of a series by their time step."""
    found = ElementTree.parse(path).getroot().iterfind(".//DataSet")
    return {int(one.get("timestep")): path.parent / one.get("file") for one in found}


def polylines(arrays):
    ends = arrays["Lines", "offsets"][:, 0]
    order = np.split(arrays["Lines", "connectivity"][:, 0], ends[:-1])
    return [arrays["Points", "Points"][some, :2] for some in order]


def test_points_stand_where_they_were_measured_with_their_displacement(written, tracks):
    series = steps(written / "points.pvd")
    assert sorted(series) == [frame for frame in range(tracks.sizes["frame"]) if frame != 5]
    found = read(series[6])
    kept = np.delete(np.arange(tracks.sizes["point"]), 3)
    np.testing.assert_array_equal(found["PointData", "point"][:, 0], kept)
    x, y = (tracks[name].to_numpy()[6, kept] for name in ("x_mm", "y_mm"))
    np.testing.assert_array_equal(found["Points", "Points"], np.column_stack([x, y, np.zeros_like(x)]))
    moved = found["PointData", "displacement_mm"][:, 0]
    np.testing.assert_array_equal(moved, x - tracks["x0_mm"].to_numpy()[kept])
    np.testing.assert_array_equal(found["PointData", "std_mm"][:, 0], tracks["std_mm"].to_numpy()[6, kept])
    assert (found["PointData", "status"] == Status.OK).all()
    assert found["FieldData", "u_mm"][0, 0] == tracks["u_mm"].to_numpy()[6]


def test_a_lost_point_stands_where_it_was_last_with_the_reason_and_that_frame(written, tracks):
    series = steps(written / "lost.pvd")
    assert sorted(series) == [4, 5, *range(6, tracks.sizes["frame"])]
    found = read(series[6])
    np.testing.assert_array_equal(found["PointData", "point"], [[3]])
    np.testing.assert_array_equal(found["PointData", "last_frame"], [[3]])
    assert found["PointData", "status"][0, 0] == Status.LOST
    assert found["Points", "Points"][0, 0] == tracks["x_mm"].to_numpy()[3, 3]
    whole = read(series[5])  # no photograph: all points
    assert set(whole["PointData", "last_frame"].ravel()) == {3, 4}
    assert (whole["PointData", "status"] == Status.FRAME_MISSING).all()


def test_a_torn_layer_is_two_polylines_and_no_place_is_made_up(folder, written):
    table = pd.read_csv(folder / "layers.csv")
    rows = table[(table["frame"] == 0) & (table["layer"] == 5.0)]
    found = read(steps(written / "layers.pvd")[0])
    lines = polylines(found)
    assert found["CellData", "layer_mm"].ravel().tolist() == [5.0, 5.0, 15.0, 25.0]
    assert [len(line) for line in lines[:2]] == [10, len(rows) - 11]
    np.testing.assert_array_equal(np.vstack(lines[:2]), rows[["x_mm", "y_mm"]].dropna().to_numpy())
    assert np.isfinite(found["Points", "Points"]).all()


def test_a_piece_of_one_point_is_a_vertex_and_arrays_on_cells_keep_their_order(
    folder, tmp_path, make_results
):
    own = make_results(tmp_path / "own")
    rows = pd.read_csv(own / "layers.csv").groupby(["frame", "layer"]).head(3)
    rows.loc[(rows["frame"] == 0) & (rows["layer"] == 15.0), "x_mm"] = [1.0, np.nan, 2.0]
    rows.to_csv(own / "layers.csv", index=False)
    where = export_results(own, "vtk", tmp_path)[0].parent
    found = read(steps(where / "layers.pvd")[0])
    assert found["Verts", "offsets"].ravel().tolist() == [1, 2]
    assert found["CellData", "layer_mm"].ravel().tolist() == [15.0, 15.0, 5.0, 25.0]
    assert found["Points", "Points"][found["Verts", "connectivity"][:, 0], 0].tolist() == [1.0, 2.0]


@pytest.mark.parametrize(
    ("file", "series"), [("surface.csv", "surface"), ("model/layers.csv", "model_layers")]
)
def test_lines_come_back_to_the_bit(folder, written, file, series):
    table = pd.read_csv(folder / file)
    for frame, path in steps(written / f"{series}.pvd").items():
        points = np.vstack(polylines(read(path)))
        expected = table[table["frame"] == frame][["x_mm", "y_mm"]].dropna().to_numpy()
        np.testing.assert_array_equal(points, expected)


def test_a_band_runs_from_the_tip_at_its_inclination_to_its_outcrop(folder, written):
    increments = pd.read_csv(folder / "increments.csv")
    row = increments[increments["frame"] == 7].iloc[0]
    found = read(steps(written / "bands.pvd")[7])
    (line,) = polylines(found)
    middle = row["u_mm"] + row["du_mm"] / 2
    assert line[:, 0].tolist() == [middle, row["outcrop_x_mm"]]
    slope = np.degrees(np.arctan2(*(line[1] - line[0])[::-1]))
    assert slope == pytest.approx(row["beta_deg"], abs=1e-9)
    assert found["CellData", "slip_mm"][0, 0] == row["slip_mm"]
    bands = pd.read_csv(folder / "bands.csv")
    every = read(written / "all_bands.vtp")
    for column in bands:
        np.testing.assert_array_equal(every["CellData", column][:, 0], bands[column].to_numpy(dtype=float))


def test_every_array_of_every_series_is_explained_beside_it(written):
    words = (written / "README.md").read_text(encoding="utf-8")
    for path in [*(next(iter(steps(p).values())) for p in written.glob("*.pvd")), *written.glob("*.vtp")]:
        name = path.parent.name if path.parent != written else path.stem
        (line,) = (text for text in words.splitlines() if text.startswith(f"- `{name}`"))
        columns = "columns of bands.csv" in line or name == "all_model_bands"
        arrays = {key for place, key in read(path) if place in ("PointData", "CellData")}
        if name not in ("model_layers", "lost") and not columns:
            assert {array for array in arrays if array not in line} <= {"initial_mm"}
    assert "13 lost" in words


def test_the_same_results_give_the_same_bytes(folder, written, tmp_path):
    again = export_results(folder, "vtk", tmp_path)[0].parent
    first = {path.relative_to(written): path.read_bytes() for path in written.rglob("*") if path.is_file()}
    assert {p.relative_to(again): p.read_bytes() for p in again.rglob("*") if p.is_file()} == first


def test_vtk_itself_reads_the_same_numbers(written, tracks):
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import vtk_to_numpy

    for path in written.rglob("*.vtp"):
        reader = vtk.vtkXMLPolyDataReader()
        reader.SetFileName(str(path))
        reader.Update()
        found, ours = reader.GetOutput(), read(path)
        np.testing.assert_array_equal(vtk_to_numpy(found.GetPoints().GetData()), ours["Points", "Points"])
        cells = len(ours["Verts", "offsets"]) + len(ours["Lines", "offsets"])
        assert found.GetNumberOfCells() == cells
        for place, data in (("PointData", found.GetPointData()), ("CellData", found.GetCellData())):
            names = [data.GetArrayName(k) for k in range(data.GetNumberOfArrays())]
            assert names == [name for where, name in ours if where == place]
            for name in names:
                values = ours[place, name]
                got = vtk_to_numpy(data.GetArray(name)).reshape(values.shape)
                np.testing.assert_array_equal(got, values)
