"""Series of VTK files for ParaView: points, layers, surfaces and shear bands, a time step a photograph."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from ploughval.export.contents import Contents
from ploughval.export.placing import replace_folder
from ploughval.export.vtk_bands import band_lines, increment_lines
from ploughval.export.vtk_words import README, readme
from ploughval.export.vtk_xml import Lines, collection, poly_data

ENDINGS = frozenset({".vtp", ".pvd", ".md"})
SOURCES = {"tracks": 0, "dye": 1, "model": 2}
_LAYERED = (("layers.csv", "layers"), ("model/layers.csv", "model_layers"))
_SURFACES = (("surface.csv", "surface"), ("model/surface.csv", "model_surface"))
_BANDS = (("bands.csv", "all_bands"), ("model/bands.csv", "all_model_bands"))

Series = Iterator[tuple[int, Lines]]  # one photograph after the other, never all in memory
Floats = NDArray[np.float64]


def write_vtk(contents: Contents, out: Path) -> list[Path]:
    """Write vtk/: a .pvd a series with its .vtp files, a .vtp of all bands of a side, and README.md.

    Parameters
    ----------
    contents : Contents
        What is exported.
    out : Path
        Folder in which ``vtk`` is made anew.

    Returns
    -------
    list of Path
        README.md, the series (.pvd) and the single files: what one opens.

    Raises
    ------
    DataError
        When the disk refuses, or ``vtk`` holds files that no export writes.
    """
    opened: dict[str, str] = {}

    def write(folder: Path) -> None:
        for name, series in _series(contents):
            paths = _write_series(folder, name, series)
            if paths:
                opened[name] = f"{name}.pvd"
                (folder / opened[name]).write_bytes(collection(paths))
        for name, lines in _single(contents):
            if len(lines.counts):
                opened[name] = f"{name}.vtp"
                (folder / opened[name]).write_bytes(poly_data(lines))
        (folder / README).write_bytes(readme(contents.name, list(opened)).encode())

    target = out / "vtk"
    replace_folder(target, write, ENDINGS)
    return [target / name for name in (README, *opened.values())]


def _write_series(folder: Path, name: str, series: Series) -> dict[int, str]:
    """Write a file for each photograph that shows something; their paths."""
    paths = {}
    for frame, lines in series:
        if len(lines.counts):
            paths[frame] = f"{name}/{name}_{frame:04d}.vtp"
            (folder / name).mkdir(exist_ok=True)
            (folder / paths[frame]).write_bytes(poly_data(lines))
    return paths


def _series(contents: Contents) -> Iterator[tuple[str, Series]]:
    """What changes from photograph to photograph, by name."""
    tables = {part.told.name: part.table for part in contents.parts}
    if contents.tracks is not None:
        yield "points", measured_points(contents.tracks)
        yield "lost", lost_points(contents.tracks)
    for made, names in ((layer_lines, _LAYERED), (surface_lines, _SURFACES)):
        for file, name in names:
            if file in tables:
                yield name, _by_frame(tables[file], made)
    if "increments.csv" in tables:
        yield "bands", _by_frame(tables["increments.csv"], increment_lines)


def _single(contents: Contents) -> Iterator[tuple[str, Lines]]:
    tables = {part.told.name: part.table for part in contents.parts}
    for file, name in _BANDS:
        if file in tables:
            yield name, band_lines(tables[file])


def _by_frame(table: pd.DataFrame, made: Callable[[pd.DataFrame], Lines]) -> Series:
    """The rows of each photograph as lines."""
    return ((int(float(str(frame))), made(rows)) for frame, rows in table.groupby("frame"))


def measured_points(tracks: xr.Dataset) -> Series:
    """Tracked points where they were measured, with their displacement since the first photograph."""
    start = _places(tracks, "x0_mm", "y0_mm")
    for row, frame in enumerate(_frames(tracks)):
        place = _places(tracks, "x_mm", "y_mm", row)
        there = _known(place)
        moved = np.column_stack([place - start, np.zeros(len(place))])
        arrays = {"displacement_mm": moved} | {
            name: tracks[name].to_numpy()[row].astype(np.float64) for name in ("std_mm", "zncc")
        }
        yield frame, _vertices(tracks, row, there, place, arrays)


def lost_points(tracks: xr.Dataset) -> Series:
    """Points without a place in a photograph, where they were measured last, and why."""
    frames = _frames(tracks)
    last = _places(tracks, "x0_mm", "y0_mm")
    since = np.full(tracks.sizes["point"], frames[0] if frames else 0)
    for row, frame in enumerate(frames):
        place = _places(tracks, "x_mm", "y_mm", row)
        there = _known(place)
        last, since = np.where(there[:, None], place, last), np.where(there, frame, since)
        yield frame, _vertices(tracks, row, ~there, last, {"last_frame": since})


def _vertices(
    tracks: xr.Dataset,
    row: int,
    chosen: NDArray[np.bool_],
    place: Floats,
    arrays: Mapping[str, Floats | NDArray[np.int64]],
) -> Lines:
    own = {
        "point": np.arange(len(chosen)),
        "status": tracks["status"].to_numpy()[row].astype(np.int64),
        "initial_mm": np.column_stack([_places(tracks, "x0_mm", "y0_mm"), np.zeros(len(chosen))]),
    }
    if "layer_mm" in tracks:
        own["layer_mm"] = tracks["layer_mm"].to_numpy()
    return Lines(
        place[chosen],
        np.ones(int(chosen.sum()), np.int64),
        on_points={name: values[chosen] for name, values in (own | dict(arrays)).items()},
        about={name: float(tracks[name].to_numpy()[row]) for name in ("u_mm", "time_s")},
    )


def layer_lines(rows: pd.DataFrame) -> Lines:
    """Layers of one photograph: a polyline for each unbroken piece."""
    lines = _unbroken(rows, ["layer", "source"])
    heads = lines.on_points
    first = np.cumsum(lines.counts) - lines.counts
    source = np.array([SOURCES.get(word, -1) for word in heads["source"][first]], dtype=np.int64)
    on_lines = {"layer_mm": heads["layer"][first], "source": source}
    return Lines(lines.points, lines.counts, {"std_mm": heads["std_mm"]}, on_lines, lines.about)


def surface_lines(rows: pd.DataFrame) -> Lines:
    """The free surface of one photograph."""
    lines = _unbroken(rows, [])
    return Lines(lines.points, lines.counts, about=lines.about)


def _unbroken(rows: pd.DataFrame, keys: list[str]) -> Lines:
    """Rows as polylines that end where a place is missing or a key changes; ``on_points``: every column."""
    there = rows[["x_mm", "y_mm"]].notna().all(axis=1).to_numpy()
    known = rows[there]
    pieces = np.cumsum(~there)[there]
    changes = np.ones(len(known), bool)
    changes[1:] = np.diff(pieces) > 0
    for key in keys:
        changes[1:] |= known[key].to_numpy()[1:] != known[key].to_numpy()[:-1]
    starts = np.flatnonzero(changes)
    travel = rows["u_mm"].dropna()
    return Lines(
        known[["x_mm", "y_mm"]].to_numpy(np.float64),
        np.diff(np.append(starts, len(known))) if len(known) else np.empty(0, np.int64),
        on_points={str(name): known[name].to_numpy() for name in known},
        about={"u_mm": float(travel.iloc[0]) if len(travel) else float("nan")},
    )


def _frames(tracks: xr.Dataset) -> list[int]:
    """Number of the photograph of each row of the tracks."""
    return [int(frame) for frame in tracks["frame"].to_numpy()]


def _places(tracks: xr.Dataset, x: str, y: str, row: int | None = None) -> Floats:
    parts = [tracks[name].to_numpy() if row is None else tracks[name].to_numpy()[row] for name in (x, y)]
    return np.column_stack(parts)


def _known(place: Floats) -> NDArray[np.bool_]:
    """Which places are known, (N,)."""
    known: NDArray[np.bool_] = np.isfinite(place[:, 0]) & np.isfinite(place[:, 1])
    return known
