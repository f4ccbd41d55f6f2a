"""The stages of a test that are shown, and the chapter that shows its layers at them."""

from dataclasses import replace

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ploughval.report.blocks import Chapter, Drawing, Pen
from ploughval.report.differences import differences_at, distance_parts
from ploughval.report.figures import Side, Stage, layers_figure
from ploughval.report.figures.layers import Extent, Picture, Points, stage
from ploughval.report.figures.look import pixels_across
from ploughval.report.photographs import Photographs, open_photographs
from ploughval.results import Results

Values = NDArray[np.float64]
# Pixels of photograph in all stages: noise-like sand costs about a third of a byte each.
PHOTO_PIXELS = 4_000_000
WIDEST_PX = 900

_LEADS = {
    (
        True,
        True,
    ): "Lines that were level before the blade moved. The measured ones are coloured by their distance "
    "along the normal from the predicted ones, which are dashed; grey where that is within twice its "
    "uncertainty, thin where no predicted line is near.",
    (True, False): "Lines that were level before the blade moved. Dotted lines follow dyed sand, full lines "
    "tracked points.",
    (False, True): "Lines that were level before the blade moved, as they are predicted; none was measured.",
}
MOST_FIELDS = 6  # a field is heavy; the layers show every stage


def stage_frames(results: Results) -> list[int]:
    """The frames that are to be shown, or those nearest to equal steps of displacement, the last included."""
    if results.shown:
        return list(results.shown)
    places = _places(results)
    places = places[places["u_mm"] > 0]
    if places.empty:
        return []
    count = int(results.setting("report", "frames_shown") or 4)
    wanted = float(places["u_mm"].max()) * np.arange(1, count + 1) / count
    return sorted({_nearest(places, u) for u in wanted})


def stage_near(results: Results, u_mm: float | None) -> Results:
    """The results with the one stage shown that is nearest to a displacement; None: the last."""
    return _with_stage(results, _places(results), u_mm)


def increment_near(results: Results, u_mm: float | None) -> Results:
    """The results with the one stage shown that has tracked points nearest to a displacement."""
    return _with_stage(results, _track_frames(results), u_mm)


def _with_stage(results: Results, places: pd.DataFrame, u_mm: float | None) -> Results:
    known = places[places["u_mm"].notna()]
    if known.empty:
        return results
    u = float(known["u_mm"].max()) if u_mm is None else u_mm
    return replace(results, shown=(_nearest(known, u),))


def _nearest(places: pd.DataFrame, u_mm: float) -> int:
    return int(places["frame"].iloc[int(np.argmin(np.abs(places["u_mm"].to_numpy(float) - u_mm)))])


def _places(results: Results) -> pd.DataFrame:
    """Frames that show something, with their displacements."""
    return pd.concat(
        [
            table.loc[table["u_mm"].notna() & table["x_mm"].notna(), ["frame", "u_mm"]]
            for table in (results.layers, results.model_layers, results.surface)
            if table is not None
        ]
        or [_track_frames(results)]
    ).drop_duplicates("frame")


def increments_shown(results: Results) -> list[tuple[int, int, int]]:
    """Stages with tracked points, MOST_FIELDS at most and the last among them.

    Each as its frame, and the rows of the tracks with which the increment that leads to it begins and ends.
    """
    tracks, frames = results.tracks, stage_frames(results)
    if tracks is None:
        return []
    u, numbers = tracks["u_mm"].to_numpy(), tracks["frame"].to_numpy()
    measured = np.isfinite(tracks["x_mm"].to_numpy()).any(axis=1)
    shown = []
    for frame in frames[:: -max(1, -(-len(frames) // MOST_FIELDS))][::-1]:
        row = int(np.argmin(np.abs(numbers - frame)))
        earlier = np.flatnonzero(measured[:row] & (u[:row] < u[row]))
        if numbers[row] == frame and measured[row] and earlier.size:
            shown.append((frame, int(earlier[-1]), row))
    return shown


def _track_frames(results: Results) -> pd.DataFrame:
    if results.tracks is None:
        return pd.DataFrame({"frame": [], "u_mm": []})
    seen = np.isfinite(results.tracks["x_mm"].to_numpy()).any(axis=1)
    return pd.DataFrame(
        {"frame": results.tracks["frame"].to_numpy()[seen], "u_mm": results.tracks["u_mm"].to_numpy()[seen]}
    )


def view(results: Results) -> Extent:
    """Part of the world that shows the blade, the bands and the heap at every stage: x0, x1, y0, y1 in mm."""
    lines = [
        table.dropna(subset=["x_mm", "y_mm", "u_mm"])[["x_mm", "y_mm", "u_mm"]].to_numpy(float)
        for table in (results.layers, results.model_layers, results.surface)
        if table is not None
    ]
    if results.tracks is not None:
        seen = results.tracks[["x_mm", "y_mm", "u_mm"]].to_dataframe().dropna()
        lines.append(seen[["x_mm", "y_mm", "u_mm"]].to_numpy(float))
    x, y, u = np.vstack([*lines, [[0.0, 0.0, 0.0]]]).T
    travel = float(u.max())
    depth = results.depth_mm or max(float(y.max()), 1.0)
    reach = [travel + 2 * depth]
    for table in (results.bands, results.model_bands, results.increments, results.model_force):
        if table is not None and table["outcrop_x_mm"].notna().any():
            reach.append(float(table["outcrop_x_mm"].max()) + depth / 2)
    thickness = results.thickness_mm
    far = max(travel + depth, min(max(reach), float(x.max())))
    top = float(np.max(y[x <= far], initial=depth))
    return (-thickness - 0.1 * depth, far, -0.3 * depth, top + 0.35 * depth)


def layers_chapter(
    results: Results, pen: Pen, photographs: Photographs | None = None, *, photo_pixels: int = PHOTO_PIXELS
) -> Chapter | None:
    """Deformed layers, predicted above measured, over the photograph where it can be read.

    Parameters
    ----------
    results : Results
        The files of a run.
    pen : Pen
        Draws the figures.
    photographs : Photographs or None
        Those of the test if they have been opened already.
    photo_pixels : int
        Pixels of photograph in all figures together.
    """
    if results.layers is None and results.model_layers is None:
        if results.surface is None:
            return None
        title, lead = "Free surface", ""
    else:
        title, lead = (
            "Deformed layers",
            _LEADS[results.layers is not None, results.model_layers is not None],
        )
    frames = stage_frames(results)
    if not frames:
        return Chapter("layers", title, notes=("No stage after the blade moved has a line to show.",))
    photographs = photographs or open_photographs(results)
    extent = view(results)
    width = photo_width(photographs, extent, photo_pixels // len(frames))
    drawings, unread = [], []
    differences = differences_at(results, frames)
    for frame in frames:
        picture = None if photographs is None else photographs.picture(frame, extent, width=width)
        if photographs is not None and picture is None and not photographs.missing:
            unread.append(frame)
        one = stage_at(results, frame, picture)
        figure = layers_figure(
            one.predicted,
            one.measured,
            u_mm=one.u_mm,
            depth_mm=results.depth_mm or extent[3],
            extent=extent,
            thickness_mm=results.thickness_mm,
            differences=differences.get(frame),
        )
        drawings.append(_drawn(pen, figure, frame, one.u_mm, coloured=frame in differences))
    notes = [photographs.missing] if photographs is not None and photographs.missing else []
    notes += [f"The photograph of frame {frame} is not shown: it cannot be read." for frame in unread]
    whole, tables = distance_parts(results, pen)
    return Chapter("layers", title, lead=lead, grid=drawings, drawings=whole, tables=tables, notes=notes)


def _drawn(pen: Pen, figure: Figure, frame: int, u_mm: float, *, coloured: bool) -> Drawing:
    """The layers of one stage with their words."""
    how = ", coloured by their distance from the predicted ones." if coloured else "."
    return pen.draw(
        figure,
        f"Tracer layers at u = {u_mm:.1f} mm: predicted above, measured below{how}",
        f"Frame {frame}, u = {u_mm:.1f} mm.",
        name=f"layers-f{frame:03d}",
        data=("layers.csv", "surface.csv", "model/layers.csv", "model/surface.csv"),
    )


def stage_at(results: Results, frame: int, picture: Picture | None = None) -> Stage:
    """Both sides of a frame: layers, surfaces, and where the bands that slip meet the surface."""
    u = _displacement(results, frame)
    surface, above = stage(results.surface, frame), stage(results.model_surface, frame)
    ends = outcrops(results.bands, u, surface=surface, history=results.increments)
    measured = Side(stage(results.layers, frame), surface, ends, picture)
    ends = outcrops(results.model_bands, u, surface=above, history=results.model_force)
    return Stage(u, Side(stage(results.model_layers, frame), above, ends), measured)


def photo_width(photographs: Photographs | None, extent: Extent, pixels: int) -> int:
    """Pixels across a photograph: what the page has room for, or what print can show, if the camera saw them.

    Parameters
    ----------
    photographs : Photographs or None
        Those of the test.
    extent : tuple of float, mm
        x0, x1, y0, y1: part of the world that is shown.
    pixels : int
        Of one photograph on the page.
    """
    aspect = (extent[3] - extent[2]) / (extent[1] - extent[0])
    width = pixels_across(int(min(WIDEST_PX, (pixels / aspect) ** 0.5)))
    native = 0 if photographs is None else photographs.native_width(extent)
    return min(width, native) if native else width


def outcrops(
    bands: pd.DataFrame | None,
    u_mm: float,
    *,
    surface: pd.DataFrame | None = None,
    history: pd.DataFrame | None = None,
) -> Points:
    """Where the bands that slip at a displacement meet the surface, (K, 2) mm.

    A history (outcrop_x_mm and beta_deg against u_mm) knows a band that creeps on; without one the outcrop
    is taken to stay where the band started. Its height is that of the surface there, or follows from beta.
    """
    x, y = _from_history(history, u_mm) if history is not None else _from_bands(bands, u_mm)
    if surface is not None and surface["y_mm"].notna().any():
        line = surface.dropna(subset=["x_mm", "y_mm"]).sort_values("x_mm")
        inside = (x >= line["x_mm"].iloc[0]) & (x <= line["x_mm"].iloc[-1])
        y = np.where(inside, np.interp(x, line["x_mm"], line["y_mm"]), y)
    return np.column_stack([x, y])


def increment_at(history: pd.DataFrame, u_mm: float) -> pd.Series | None:
    """The row whose increment is nearest to a displacement, of those in which a band slips."""
    known = history.dropna(subset=["u_mm", "beta_deg", "outcrop_x_mm"])
    if known.empty:
        return None
    half = known["du_mm"] / 2 if "du_mm" in known else 0.0
    return known.iloc[int((known["u_mm"] + half - u_mm).abs().argmin())]


def _from_history(history: pd.DataFrame, u_mm: float) -> tuple[Values, Values]:
    now = increment_at(history, u_mm)
    if now is None:
        return np.empty(0), np.empty(0)
    x = np.array([float(now["outcrop_x_mm"])])
    return x, (x - u_mm) * np.tan(np.radians(float(now["beta_deg"])))


def _from_bands(bands: pd.DataFrame | None, u_mm: float) -> tuple[Values, Values]:
    if bands is None:
        return np.empty(0), np.empty(0)
    active = bands[(bands["u_start_mm"] <= u_mm) & (bands["u_end_mm"].fillna(np.inf) >= u_mm)]
    x = active["outcrop_x_mm"].to_numpy(float)
    tangent = np.tan(np.radians(active["beta_deg"].to_numpy(float)))
    return x, (x - active["u_start_mm"].to_numpy(float)) * tangent


def _displacement(results: Results, frame: int) -> float:
    for table in (results.layers, results.model_layers, results.surface, results.model_surface):
        rows = stage(table, frame)
        if rows is not None and rows["u_mm"].notna().any():
            return float(rows["u_mm"].dropna().iloc[0])
    return float("nan")
