"""Boards seen by known cameras: re-projected to 0.1 px, also tilted, blurred, glaring or half covered."""

import cv2
import numpy as np
import pytest

from ploughval.photos.calibration.board import BoardPoints, find_board
from ploughval.photos.calibration.board_fit import centre_offset_px, fit_board, place_board
from ploughval.photos.calibration.camera_fit import PointSet, fit_camera
from ploughval.photos.calibration.lattice import grow_lattice
from ploughval.scene import Board, Window

SHAPE = (640, 960)
CORNER_MM = np.array([-5.0, 110.0])  # upper left of every board, in the window's plane
COLUMNS, ROWS = 11, 7
CHESS_MM, CHARUCO_MM, MARKER_MM, DOT_MM = 15.0, 20.0, 15.0, 5.0


def on_board(mm):
    """Places on the board: x right, y down from its corner."""
    return (mm - CORNER_MM) * [1, -1]


def chessboard(mm):
    x, y = on_board(mm).T
    inside = (x > 0) & (y > 0) & (x < (COLUMNS + 1) * CHESS_MM) & (y < (ROWS + 1) * CHESS_MM)
    return np.where(inside, (np.floor(x / CHESS_MM) + np.floor(y / CHESS_MM)) % 2, 1.0)


def dots(mm):
    x, y = on_board(mm).T / CHESS_MM
    off = np.hypot(x - np.rint(x), y - np.rint(y)) * CHESS_MM
    inside = (np.rint(x) > 0) & (np.rint(y) > 0) & (np.rint(x) <= COLUMNS) & (np.rint(y) <= ROWS)
    return np.where(inside & (off < DOT_MM), 0.0, 1.0)


def charuco(mm):
    markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    pattern = cv2.aruco.CharucoBoard((9, 5), CHARUCO_MM, MARKER_MM, markers)
    texels = pattern.generateImage((9 * 160, 5 * 160))
    column, row = np.floor(on_board(mm) * 8).astype(int).T  # 8 texels a mm
    inside = (column >= 0) & (row >= 0) & (column < 9 * 160) & (row < 5 * 160)
    return np.where(inside, texels[np.clip(row, 0, 799), np.clip(column, 0, 1439)] / 255, 1.0)


BOARDS = {
    "chessboard": (
        chessboard,
        Board(kind="chessboard", picture="", columns=COLUMNS, rows=ROWS, spacing_mm=CHESS_MM),
    ),
    "dots": (dots, Board(kind="dots", picture="", columns=COLUMNS, rows=ROWS, spacing_mm=CHESS_MM)),
    "charuco": (
        charuco,
        Board(kind="charuco", picture="", columns=9, rows=5, spacing_mm=CHARUCO_MM, marker_mm=MARKER_MM),
    ),
}
TILTS = {"3 degrees": (2.1, -2.1), "15 degrees": (12.0, -9.0)}


@pytest.fixture(scope="module")
def camera(cameras):
    def make(tilt="3 degrees", k1=-0.01):
        return cameras.made_camera(
            tilt_deg=TILTS[tilt], roll_deg=1.5, distance_mm=800.0, lens=(k1, 0, 0, 0), shape=SHAPE, share=0.9
        )

    return make


@pytest.fixture(scope="module")
def picture(cameras, camera):
    """Photographs of the boards, with noise of two grey levels; each is rendered once."""
    clean = {}

    def make(kind, seed, tilt="3 degrees", blur_px=0.0):
        if (kind, tilt) not in clean:
            clean[kind, tilt] = cameras.photographed(camera(tilt), BOARDS[kind][0], noise=0.0)
        image = clean[kind, tilt].astype(np.float32)
        image = cv2.GaussianBlur(image, (0, 0), blur_px) if blur_px else image
        return np.rint(image + np.random.default_rng(seed).normal(0, 2.0, SHAPE)).astype(np.uint8)

    return make


def with_glare(image, place, width):
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    shine = 230 * np.exp(-((x - place[0]) ** 2 + (y - place[1]) ** 2) / (2 * width**2))
    return np.clip(image + shine, 0, 255).astype(np.uint8)


def half_covered(image):
    covered = image.copy()
    covered[:, :430] = 90  # a sheet over the left of the board
    return covered


def worst_px(camera, image, kind, tmp_path):
    """Largest error over all of the board, seen or not, of the camera fitted to its picture; and the fit."""
    _, board = BOARDS[kind]
    path = tmp_path / "board.png"
    cv2.imwrite(str(path), image)
    found = find_board(path, board, SHAPE)
    fit, points = fit_board(found, PointSet(found.px, found.mm, SHAPE), None)
    step = board.spacing_mm
    # where the board's origin stands is not told by a part of it: found from the nearest crossing
    reach = np.arange(1, 12)[:, None] * [step, 0] + CORNER_MM, np.arange(1, 9)
    grid = np.concatenate([reach[0] - [0, step * k] for k in reach[1]])
    true_px = camera.photograph(grid, camera.outside_mm)
    first = fit.model.to_px(points.mm[:1])[0]
    origin = grid[np.argmin(np.hypot(*(true_px - first).T))]
    right = fit.model.to_px(points.mm[0] + [1.0, 0.0])[0] > first[0]
    board_mm = points.mm[0] + (grid - origin) * ([1, -1] if right else [-1, 1])  # it may stand on its head
    width, height = (9 * 20, 5 * 20) if kind == "charuco" else (12 * 15, 8 * 15)
    inside = (on_board(grid)[:, 0] < width - 1) & (on_board(grid)[:, 1] < height - 1)
    return np.hypot(*(fit.model.to_px(board_mm) - true_px)[inside].T).max(), fit


@pytest.mark.parametrize("kind", BOARDS)
@pytest.mark.parametrize("tilt", TILTS)
def test_a_board_is_reprojected_to_0p1_px_through_a_bent_lens(camera, picture, kind, tilt, tmp_path):
    error, fit = worst_px(camera(tilt), picture(kind, 1, tilt), kind, tmp_path)
    assert error < 0.1
    assert np.sqrt(np.mean(np.sum(fit.residual_px**2, axis=1))) < 0.1
    assert "k1" in fit.term_names


@pytest.mark.parametrize("kind", BOARDS)
def test_a_board_out_of_focus_is_reprojected_to_0p1_px(camera, picture, kind, tmp_path):
    assert worst_px(camera(), picture(kind, 2, blur_px=2.4), kind, tmp_path)[0] < 0.1


@pytest.mark.parametrize("kind", BOARDS)
def test_glare_over_the_board_costs_the_points_under_it(camera, picture, kind, tmp_path):
    error, fit = worst_px(camera(), with_glare(picture(kind, 3), (400, 300), 60), kind, tmp_path)
    assert error < 0.1
    assert len(fit.residual_px) >= 20


@pytest.mark.parametrize("kind", BOARDS)
def test_what_is_left_of_a_half_covered_board_is_used(camera, picture, kind, tmp_path):
    error, fit = worst_px(camera(), half_covered(picture(kind, 4)), kind, tmp_path)
    # the covered half is extrapolated, with a lens held by the other half
    assert error < 0.5
    assert np.sqrt(np.mean(np.sum(fit.residual_px**2, axis=1))) < 0.1


def test_the_centre_of_a_tilted_dots_image_is_not_the_image_of_its_centre(cameras, camera):
    seen = camera("15 degrees", k1=0.0)
    mm = cameras.window_points(20)
    turn = np.linspace(0, 2 * np.pi, 721)[:-1]
    radius_mm = 8.0
    expected = []
    for centre in mm:
        disc = centre + radius_mm * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        rim = seen.photograph(disc, seen.outside_mm)
        (x, y), _, _ = cv2.fitEllipseDirect(rim.astype(np.float32))
        expected.append([x, y])
    centre_px = seen.photograph(mm, seen.outside_mm)
    model = fit_camera(PointSet(centre_px, mm, SHAPE)).model
    off = centre_offset_px(model, mm, radius_mm / model.mm_per_px_at(centre_px))
    assert np.hypot(*off.T).max() > 0.05
    np.testing.assert_allclose(off, np.array(expected) - centre_px, atol=3e-3)  # cv2 fits in single precision


@pytest.mark.parametrize("side", ["outside", "inside"])
def test_a_board_on_either_face_of_the_window_places_the_sand(cameras, side):
    seen = cameras.made_camera(
        tilt_deg=(2.1, -2.1), distance_mm=800.0, lens=(-0.01, 0, 0, 0), pane=(20.0, 1.49)
    )
    window = Window(thickness_mm=20.0, distance_mm=float(seen.place_mm[2] - 20.0), points_on=side)
    grid = cameras.window_points(40)
    px = seen.photograph(grid, seen.outside_mm if side == "outside" else seen.sand_mm)
    board_mm = (grid - [3.0, 7.0]) @ np.array([[0.6, -0.8], [-0.8, -0.6]])  # it lies turned and mirrored
    first, points = fit_board(BoardPoints(px, board_mm), PointSet(px, board_mm, cameras.SHAPE), window)
    tip_mm, ahead_mm = np.array([5.0, 2.0]), np.array([5.001, 2.0])
    tip_px, ahead_px = seen.photograph(np.stack([tip_mm, ahead_mm]))
    world = place_board(first.model, points.mm, tip_px, tip_px + np.array([1.0, 0.0]))
    model = fit_camera(points.with_mm(world), window).model
    sand = cameras.over_window()
    found = model.to_mm(seen.photograph(sand))
    np.testing.assert_allclose(model.to_mm(tip_px), [0, 0], atol=1e-6)
    # the rows of the picture at the tip are the line of travel: turned against the window's by the same angle
    angle = np.arctan2(*(model.to_mm(ahead_px))[::-1])
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    np.testing.assert_allclose(found, (sand - tip_mm) @ turn, atol=1e-4)


def test_a_lattice_is_told_from_points_that_do_not_belong_to_it(camera):
    rng = np.random.default_rng(5)
    columns, rows = np.meshgrid(np.arange(9), np.arange(6))
    cells = np.column_stack([columns.ravel(), rows.ravel()])
    kept = rng.permutation(len(cells))[:46]  # eight are missing
    px = camera().photograph(cells[kept] * [15.0, -15.0] + [5.0, 90.0])
    others = rng.uniform([0, 0], [960, 640], (15, 2))
    far = np.hypot(*np.moveaxis(others[:, None] - px, -1, 0)).min(axis=1) > 20
    chosen, found = grow_lattice(np.concatenate([px, others[far]]))
    own = chosen < len(px)
    assert own.sum() >= 44
    shift = found[own][0] - cells[kept][chosen[own][0]]
    assert (found[own] - cells[kept][chosen[own]] == shift).all()


def test_no_lattice_is_seen_in_scattered_points():
    points = np.random.default_rng(6).uniform(0, 900, (60, 2))
    assert len(grow_lattice(points)[0]) < 20
