"""Points of a calibration board in a photograph: chessboard corners, ChArUco corners, or a grid of dots."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.errors import CalibrationError
from ploughval.photos.decode import decode_8bit
from ploughval.scene import Board

Points = NDArray[np.float64]


def find_board(picture: Path, board: Board, shape: tuple[int, int]) -> tuple[Points, Points]:
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
    px, mm : (N, 2) float
        Points in the photograph and on the board.

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
    if found is None or len(found[0]) < 4:
        raise CalibrationError(
            f"{picture}: no {board.kind} board of {board.columns} x {board.rows} found. Check columns, "
            "rows and kind; the whole board must be in view, sharp and evenly lit"
        )
    return found


def _grid(board: Board) -> Points:
    """Places of the points of a full grid, row by row, mm."""
    rows, columns = np.mgrid[: board.rows, : board.columns]
    return np.column_stack([columns.ravel(), rows.ravel()]) * board.spacing_mm


def _chessboard(image: NDArray[np.uint8], board: Board) -> tuple[Points, Points] | None:
    size = (board.columns, board.rows)
    flags = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_NORMALIZE_IMAGE
    ok, corners = cv2.findChessboardCornersSB(image, size, flags=flags)
    if not ok:
        ok, corners = cv2.findChessboardCorners(image, size)
        if not ok:
            return None
    return _sharpen(image, np.asarray(corners), 0.23), _grid(board)


def _sharpen(image: NDArray[np.uint8], corners: NDArray[np.float32], reach: float) -> Points:
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


def _charuco(image: NDArray[np.uint8], board: Board) -> tuple[Points, Points] | None:
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
            return _sharpen(image, np.asarray(corners), reach), places[np.asarray(ids).ravel()]
    return None


def _dots(image: NDArray[np.uint8], board: Board) -> tuple[Points, Points] | None:
    settings = cv2.SimpleBlobDetector.Params()
    settings.filterByArea, settings.minArea = True, 20.0
    settings.maxArea = image.size / (board.columns * board.rows)
    settings.minDistBetweenBlobs = 4.0
    detector = cv2.SimpleBlobDetector.create(settings)
    for picture in (image, 255 - image):  # dark dots on pale, then pale dots on dark
        ok, centres = cv2.findCirclesGrid(
            picture, (board.columns, board.rows), flags=cv2.CALIB_CB_SYMMETRIC_GRID, blobDetector=detector
        )
        if ok:
            return np.asarray(centres, float).reshape(-1, 2), _grid(board)
    return None
