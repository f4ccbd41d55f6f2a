"""Points of a calibration board in a photograph: chessboard corners, ChArUco corners, or a grid of dots.

Where a part of the board is covered or glares, what is left of its grid is used: the place of the board's
own origin does not matter, for the world begins at the tip.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.errors import CalibrationError
from ploughval.photos.calibration.lattice import grow_lattice
from ploughval.photos.reading.decode import decode_8bit
from ploughval.scene import Board

Points = NDArray[np.float64]
Image = NDArray[np.uint8]

_LEAST_SHARE = 0.3  # of the grid's points
_MOST_CROSSINGS = 4000
_TURNS = 32
_TWOFOLD = 0.6  # of the variance on a circle; a perfect crossing has 0.81, a corner 0.3
_SADDLES_PX = (2.0, 4.0)  # widths of the smoothing under which crossings are looked for


@dataclass(frozen=True, slots=True, eq=False)
class BoardPoints:
    """Points of a board: (N, 2) px in the photograph, (N, 2) mm on it; radius (N,) px of dots, else None."""

    px: Points
    mm: Points
    radius_px: Points | None = None


def find_board(picture: Path, board: Board, shape: tuple[int, int]) -> BoardPoints:
    """Find a board's points.

    Parameters
    ----------
    picture : Path
        Photograph of the board by the camera of the test, unmoved.
    board : Board
        What the board is.
    shape : (H, W)
        Size of the test's photographs, px.

    Returns
    -------
    BoardPoints

    Raises
    ------
    CalibrationError
        Board not found, or a picture of another size.
    DataError
        A picture that cannot be read.
    """
    image = decode_8bit(picture)
    if image.shape != shape:
        raise CalibrationError(
            f"{picture}: {image.shape[1]} x {image.shape[0]} px; expected {shape[1]} x {shape[0]} px as "
            "in the photographs of the test, taken from the same place"
        )
    finders = {"chessboard": _chessboard, "charuco": _charuco, "dots": _dots}
    found = finders[board.kind](image, board)
    if found is None or len(found.px) < 4:
        raise CalibrationError(
            f"{picture}: no {board.kind} board of {board.columns} x {board.rows} found. Check columns, "
            "rows and kind; most of the board must be in view, sharp and evenly lit"
        )
    return found


def _grid(board: Board) -> Points:
    """Places of the points of a full grid, row by row, mm."""
    rows, columns = np.mgrid[: board.rows, : board.columns]
    return np.column_stack([columns.ravel(), rows.ravel()]) * board.spacing_mm


def _chessboard(image: Image, board: Board) -> BoardPoints | None:
    size = (board.columns, board.rows)
    flags = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_NORMALIZE_IMAGE
    ok, corners = cv2.findChessboardCornersSB(image, size, flags=flags)
    if not ok:
        ok, corners = cv2.findChessboardCorners(image, size)
    if ok:
        return BoardPoints(_sharpen(image, np.asarray(corners), 0.23), _grid(board))
    for width in _SADDLES_PX:
        found = _part_of_grid(_crossings(image, width), board)
        if found is not None:
            px, mm = found
            return BoardPoints(_sharpen(image, px, 0.23), mm)
    return None


def _crossings(image: Image, width_px: float) -> Points:
    """Places (M, 2) where two dark and two pale corners may meet: saddles of the smoothed grey levels."""
    smooth = cv2.GaussianBlur(image.astype(np.float32), (0, 0), width_px)
    xx, yy, xy = (cv2.Sobel(smooth, cv2.CV_32F, *order) for order in ((2, 0), (0, 2), (1, 1)))
    saddle = xy * xy - xx * yy
    reach = 2 * int(3 * width_px) + 1
    peak = (saddle == cv2.dilate(saddle, np.ones((reach, reach), np.uint8))) & (
        saddle > 0.2 * np.quantile(saddle, 0.999)
    )
    strongest = np.argsort(-saddle[peak], kind="stable")[:_MOST_CROSSINGS]
    places = np.argwhere(peak)[strongest, ::-1].astype(float)
    if not len(places):
        return places
    return places[_twofold(smooth, places, 3 * width_px) > _TWOFOLD]


def _twofold(image: NDArray[Any], places: Points, radius_px: float) -> Points:
    """Share of the grey's variance on a circle about each place that alternates twice, as at a crossing."""
    turn = 2 * np.pi * np.arange(_TURNS) / _TURNS
    x = (places[:, :1] + radius_px * np.cos(turn)).astype(np.float32)
    y = (places[:, 1:] + radius_px * np.sin(turn)).astype(np.float32)
    grey = cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    power = np.abs(np.fft.rfft(grey, axis=1)[:, 1:]) ** 2
    return np.asarray(power[:, 1] / np.maximum(power.sum(axis=1), 1e-9), float)


def _part_of_grid(candidates: Points, board: Board) -> tuple[Points, Points] | None:
    """The candidates that form a part of the board's grid, and their places on it; None if too few do."""
    chosen, cell = grow_lattice(candidates)
    if len(chosen) < max(6, _LEAST_SHARE * board.columns * board.rows):
        return None
    span = np.ptp(cell, axis=0) + 1
    across, down = board.columns, board.rows
    if not ((span <= [across, down]).all() or (span <= [down, across]).all()) or span.min() < 3:
        return None
    return candidates[chosen], (cell - cell.min(axis=0)) * board.spacing_mm


def _sharpen(image: Image, corners: NDArray[Any], reach: float) -> Points:
    """Refine corners (N, 2) where the edges of the squares cross, within `reach` of the side of a square.

    A window as large as the square allows: it is five times as exact as the finders' own places.
    """
    corners = corners.reshape(-1, 2).astype(np.float32)
    apart = np.hypot(*np.moveaxis(corners[:, None] - corners, -1, 0))
    np.fill_diagonal(apart, np.inf)
    half = max(3, int(reach * np.median(apart.min(axis=1))))
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-4)
    sharp = cv2.cornerSubPix(image, corners.reshape(-1, 1, 2), (half, half), (-1, -1), stop)
    return np.asarray(sharp, float).reshape(-1, 2)


def _charuco(image: Image, board: Board) -> BoardPoints | None:
    number = getattr(cv2.aruco, board.dictionary, None)
    if not board.dictionary.startswith("DICT_") or not isinstance(number, int):
        raise CalibrationError(
            f"camera.board.dictionary: got {board.dictionary!r}; expected one such as DICT_4X4_50"
        )
    if board.marker_mm is None or not board.marker_mm < board.spacing_mm:
        raise CalibrationError(
            f"camera.board.marker_mm: got {board.marker_mm}; expected less than spacing_mm"
        )
    markers = cv2.aruco.getPredefinedDictionary(number)
    for legacy in (False, True):  # boards printed before OpenCV 4.6 begin with the other colour
        pattern = cv2.aruco.CharucoBoard(
            (board.columns, board.rows), board.spacing_mm, board.marker_mm, markers
        )
        pattern.setLegacyPattern(legacy)
        corners, ids, _, _ = cv2.aruco.CharucoDetector(pattern).detectBoard(image)
        if ids is not None and len(ids) >= 4:
            places = np.asarray(pattern.getChessboardCorners(), float).reshape(-1, 3)[:, :2]
            reach = 0.45 * (1 - board.marker_mm / board.spacing_mm)  # to the rim of the nearest markers
            return BoardPoints(_sharpen(image, np.asarray(corners), reach), places[np.asarray(ids).ravel()])
    return None


def _dots(image: Image, board: Board) -> BoardPoints | None:
    settings = cv2.SimpleBlobDetector.Params()
    settings.filterByArea, settings.minArea = True, 20.0
    settings.maxArea = image.size / (board.columns * board.rows)
    settings.minDistBetweenBlobs = 4.0
    detector = cv2.SimpleBlobDetector.create(settings)
    size = (board.columns, board.rows)
    for picture in (image, 255 - image):  # dark dots on pale, then pale dots on dark
        blobs = detector.detect(picture)
        if len(blobs) < 4:
            continue
        centres = np.array([blob.pt for blob in blobs], float)
        ok, grid = cv2.findCirclesGrid(
            picture, size, flags=cv2.CALIB_CB_SYMMETRIC_GRID, blobDetector=detector
        )
        found = (
            (np.asarray(grid, float).reshape(-1, 2), _grid(board)) if ok else _part_of_grid(centres, board)
        )
        if found is not None:
            px, mm = found
            nearest = np.argmin(np.hypot(*np.moveaxis(px[:, None] - centres, -1, 0)), axis=1)
            return BoardPoints(px, mm, np.array([blobs[k].size / 2 for k in nearest]))
    return None
