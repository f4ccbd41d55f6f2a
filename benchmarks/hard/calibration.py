"""Hard cases of the calibration: control points and boards of made cameras, few, crowded, wrong or bent."""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
from numpy.typing import NDArray

from hard.cases import NO_WORDS, Canvas, Happened, HardCase, Part
from made.cameras import MadeCamera, made_camera, over_window, photographed, window_points
from ploughval.photos.calibration.calibrate import calibrate
from ploughval.photos.calibration.mapping import Calibration
from ploughval.report.figures.style import INK, MEASURED, MODEL, MUTED
from ploughval.scene import Scene

Floats = NDArray[np.float64]
Spoil = Callable[[Floats, Floats], tuple[Floats, Floats]]

READ_PX = 0.3
STDS = 4.0  # of the largest error over the window: its places share the few drawn errors
LENS = (-0.01, 0.0, 0.0, 0.0)
BOARD = (13, 9, 10.0)  # inner corners along x and y, side of a square in mm
CORNER_MM = np.array([15.0, 108.0])
MUST = (
    f"no place of the window is off by more than {STDS:g} of its stated deviations, or the points are refused"
)


@dataclass(frozen=True, slots=True)
class Drawn:
    """Places of the window, their errors, control points; mm."""

    places: Floats
    error: Floats
    points: Floats
    stated: Floats


def scene_of(**camera: object) -> Scene:
    """A scene whose camera is calibrated as told."""
    return Scene.model_validate(
        {
            "test": {"name": "hard"},
            "blade": {"depth_mm": 30.0, "width_mm": 200.0},
            "camera": {"photos": "*.png", **camera},
        }
    )


def by_points(camera: MadeCamera, mm: Floats, spoil: Spoil | None = None, seed: int = 1) -> Happened:
    """Read points to 0.3 px, type them in, calibrate."""
    rng = np.random.default_rng(seed)
    px = camera.photograph(mm) + rng.normal(0, READ_PX, mm.shape)
    typed_px, typed = (px, mm.copy()) if spoil is None else spoil(px.copy(), mm.copy())
    rows = np.column_stack([typed_px.round(2), typed.round(2)]).tolist()
    scene = scene_of(control_points=rows)
    return scored(camera, calibrate(scene, SimpleNamespace(shape=camera.shape)), mm)


def by_board(seen: float) -> Happened:
    """A chessboard of which a part is covered by a sheet."""
    camera = made_camera(tilt_deg=(3.0, -2.0), lens=LENS, shape=(800, 1200))
    picture = photographed(camera, chessboard, rng=np.random.default_rng(2))
    hidden = int((1.0 - seen) * picture.shape[1])
    picture[:, :hidden] = 90
    columns, rows, side = BOARD
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "board.png"
        cv2.imwrite(str(path), picture)
        tip, ahead = camera.photograph(np.array([[0.0, 0.0], [100.0, 0.0]]))
        board = {
            "kind": "chessboard",
            "picture": str(path),
            "columns": columns,
            "rows": rows,
            "spacing_mm": side,
        }
        scene = scene_of(board=board, tip_px=tip.tolist(), travel_px=ahead.tolist())
        found = calibrate(scene, SimpleNamespace(shape=camera.shape))
    return scored(camera, found, found.points[["x_mm", "y_mm"]].to_numpy())


def chessboard(mm: Floats) -> Floats:
    """Brightness of a board that hangs in the window, at places (N, 2) mm."""
    columns, rows, side = BOARD
    x, y = (mm - CORNER_MM).T * np.array([[1.0], [-1.0]]) / side
    dark = ((np.floor(x) + np.floor(y)) % 2 == 0) & (x >= 0) & (y >= 0) & (x < columns + 1) & (y < rows + 1)
    return np.where(dark, 0.0, 1.0)


def scored(camera: MadeCamera, found: Calibration, points: Floats) -> Happened:
    """Errors over the window against what is stated of them."""
    places = over_window()
    px = camera.photograph(places)
    error, stated = found.to_mm(px) - places, found.std_mm(px)
    worst = float((np.abs(error) / np.maximum(stated, 1e-9)).max())
    size = np.hypot(*error.T)
    what = (
        f"window within {size.max():.2g} mm ({size.max() / found.mm_per_px:.2g} px), median "
        f"{np.median(size):.2g} mm; "
        f"largest error {worst:.2g} stated deviations of up to {stated.max():.2g} mm; {found.method}"
    )
    return Happened(worst, what, found.warnings, (), Drawn(places, error, points, stated))


def typed(by: Callable[[Floats], None]) -> Spoil:
    """A slip of the one who types the points' mm."""

    def spoil(px: Floats, mm: Floats) -> tuple[Floats, Floats]:
        by(mm)
        return px, mm

    return spoil


def off_ten(mm: Floats) -> None:
    """One point 10 mm off."""
    mm[len(mm) // 2] += [7.0, -7.0]


def negative(mm: Floats) -> None:
    """One sign of x."""
    mm[len(mm) // 2 + 1, 0] *= -1


def exchanged(mm: Floats) -> None:
    """Two points exchanged."""
    mm[[0, 2]] = mm[[2, 0]]


def transposed(mm: Floats) -> None:
    """X and y of all points exchanged."""
    mm[:] = mm[:, ::-1].copy()


def lines() -> dict[str, Floats]:
    """Points on a line, and nearly so."""
    along = np.linspace(0.0, 150.0, 8)
    near = 40.0 + 0.2 * along + 0.5 * np.where(np.arange(8) % 2, 1.0, -1.0)
    return {"on": np.column_stack([along, 40.0 + 0.2 * along]), "near": np.column_stack([along, near])}


def cases() -> Sequence[HardCase]:
    """Every hard calibration."""
    rng = np.random.default_rng(0)
    plain = made_camera(tilt_deg=(4.0, -3.0), lens=LENS)
    fish = made_camera(tilt_deg=(4.0, -3.0), lens=(-0.3, 0.05, 0.0, 0.0))
    glazed = made_camera(tilt_deg=(8.0, -5.0), lens=LENS, pane=(19.0, 1.5))
    corner = window_points(12, rng) * 0.25
    many, eight = window_points(24, rng), window_points(8, rng)
    four, five, six = (window_points(n, rng) for n in (4, 5, 6))
    low = "known to|fit to"
    rows: list[tuple[str, str, Callable[[], Happened], str]] = [
        ("24 points", "read to 0.3 px", partial(by_points, plain, many), ""),
        ("4 points", "exactly as many as a homography needs", partial(by_points, plain, four), ""),
        ("5 points", "one to spare", partial(by_points, plain, five), ""),
        ("8 points on a line", "collinear", partial(by_points, plain, lines()["on"]), ""),
        (
            "8 points nearly on a line",
            "0.5 mm to either side",
            partial(by_points, plain, lines()["near"]),
            low,
        ),
        ("points in a corner", "12 points on a quarter of each side", partial(by_points, plain, corner), low),
        ("one of 24 mistyped", "10 mm off", partial(by_points, plain, many, typed(off_ten)), ""),
        ("one of 8 with a wrong sign", "of x", partial(by_points, plain, eight, typed(negative)), ""),
        ("one of 6 mistyped", "10 mm off", partial(by_points, plain, six, typed(off_ten)), ""),
        ("one of 5 mistyped", "10 mm off", partial(by_points, plain, five, typed(off_ten)), low),
        (
            "one of 4 mistyped",
            "10 mm off: nothing contradicts it",
            partial(by_points, plain, four, typed(off_ten)),
            "cannot be noticed",
        ),
        ("two of 8 exchanged", "first and third", partial(by_points, plain, eight, typed(exchanged)), ""),
        ("x and y exchanged", "all of 8 points", partial(by_points, plain, eight, typed(transposed)), ""),
        ("fish-eye, 24 points", "barrel of 30 % at the corners", partial(by_points, fish, many), low),
        ("fish-eye, 6 points", "too few for the lens", partial(by_points, fish, six), low),
        (
            "a window that nobody told of",
            "19 mm of glass, tilt of 8 degrees",
            partial(by_points, glazed, many),
            low,
        ),
        ("board in full view", "chessboard of 13 x 9 corners", partial(by_board, 1.0), ""),
        ("half of the board covered", "a sheet over its left", partial(by_board, 0.5), ""),
        ("a strip of the board", "a fifth of the picture is left", partial(by_board, 0.2), ""),
    ]
    return [HardCase(name, done, MUST, run, STDS, "std", says or NO_WORDS) for name, done, run, says in rows]


def draw(canvas: Canvas, case: HardCase, shown: Drawn) -> None:
    """Control points, and the errors over the window, enlarged so that they can be seen."""
    ax = canvas.subplots()
    size = np.hypot(*shown.error.T)
    scale = 10.0 ** np.floor(np.log10(8.0 / max(float(np.quantile(size, 0.9)), 1e-6)))
    colour = np.where((np.abs(shown.error) > STDS * shown.stated).any(axis=1), MODEL, MEASURED)
    for (x, y), (dx, dy), c in zip(shown.places[::3], scale * shown.error[::3], colour[::3], strict=True):
        ax.plot([x, x + dx], [y, y + dy], color=c, linewidth=0.9)
    ax.plot(*shown.points.T, "o", color=INK, markersize=3, markerfacecolor="none")
    ax.set_aspect("equal")
    ax.set_xlim(-20, 200)
    ax.set_ylim(-20, 130)
    ax.text(
        0.99, 0.02, f"errors x {scale:g}", transform=ax.transAxes, ha="right", color=MUTED, fontsize="small"
    )
    ax.set_xlabel("x, mm")
    ax.set_ylabel("y, mm")


PART = Part(
    "calibration",
    "Calibration",
    "Pinhole cameras with a lens, written as rays; points are read to 0.3 px. Circles: control "
    "points; strokes: "
    "the calibration's errors over the window, enlarged; orange where they are beyond what is stated.",
    cases,
    draw,
)
