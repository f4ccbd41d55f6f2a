"""Cameras with a known homography are found, and points that cannot be right are refused."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from PIL import Image

from ploughval.errors import CalibrationError, DataError
from ploughval.photos import calibrate, open_frames
from ploughval.photos.calibration.camera_fit import PointSet, fit_camera
from ploughval.photos.calibration.mapping import scale_at_origin

SHAPE = (900, 1400)
# a camera that looks at the window askew: 4 px/mm, perspective of 8 % across the window, turned by 2 degrees
WORLD_TO_PX = np.array([[4.0, 0.14, 250.0], [0.15, -4.1, 700.0], [2.5e-4, 1.5e-4, 1.0]])
MIRROR = np.array([[-1.0, 0, SHAPE[1] - 1], [0, 1, 0], [0, 0, 1]])
GRID_MM = np.stack(np.meshgrid(np.linspace(-20, 250, 5), np.linspace(-10, 120, 4)), -1).reshape(-1, 2)
INSIDE_MM = np.random.default_rng(4).uniform([-20, -10], [250, 120], (50, 2))


def to_px(matrix, mm):
    """A homography written out, apart from the code under test."""
    x, y = np.asarray(mm, float).T
    u, v, w = (matrix[k, 0] * x + matrix[k, 1] * y + matrix[k, 2] for k in range(3))
    return np.column_stack([u / w, v / w])


def points_of(matrix, mm=GRID_MM, noise=0.0):
    px = to_px(matrix, mm) + noise * np.random.default_rng(11).normal(size=(len(mm), 2))
    return np.hstack([px, mm]).tolist()


@pytest.fixture
def calibrated(make_scene, tmp_path):
    """Calibrate a scene with one photograph of SHAPE and the given [camera] keys."""

    def run(**camera):
        Image.fromarray(np.zeros(SHAPE, np.uint8)).save(tmp_path / "photos" / "a.png")
        scene = make_scene(**camera)
        return calibrate(scene, open_frames(scene))

    return run


@pytest.mark.parametrize(("direction", "sign"), [("right", 1), ("left", -1)])
def test_scale_and_tip_map_as_written(calibrated, direction, sign):
    cal = calibrated(mm_per_px=0.125, tip_px=[199.5, 599.5], direction=direction, mm_per_px_std=0.00025)
    np.testing.assert_allclose(cal.to_mm(np.array([199.5, 599.5])), [0, 0], atol=1e-12)
    # 80 px along the travel are 10 mm, 40 px up are 5 mm
    np.testing.assert_allclose(cal.to_mm(np.array([[199.5 + sign * 80, 559.5]])), [[10, 5]], atol=1e-12)
    assert cal.mm_per_px == 0.125
    assert cal.scale_std == pytest.approx(0.002)
    assert cal.direction == direction
    assert cal.points.empty
    assert "px_x" in cal.points


@pytest.mark.parametrize("count", [4, 5, 20])
def test_exact_control_points_give_the_camera_to_a_nanometre(calibrated, count):
    chosen = (
        GRID_MM[np.linspace(0, 19, count).astype(int)] if count > 5 else GRID_MM[[0, 4, 15, 19, 7][:count]]
    )
    cal = calibrated(control_points=points_of(WORLD_TO_PX, chosen))
    np.testing.assert_allclose(cal.to_mm(to_px(WORLD_TO_PX, INSIDE_MM)), INSIDE_MM, atol=1e-6)
    assert cal.residual_px < 1e-6
    assert cal.direction == "right"


def test_points_in_another_unit_are_refused_by_the_scale_that_they_give(calibrated):
    points = np.array(points_of(WORLD_TO_PX)) * [1, 1, 1e6, 1e6]  # nanometres
    with pytest.raises(CalibrationError, match=r"test\.toml, camera\.control_points: gives .* mm a pixel"):
        calibrated(control_points=points.tolist())


def test_clicked_control_points_place_the_window_within_0p1_mm(calibrated):
    cal = calibrated(control_points=points_of(WORLD_TO_PX, noise=0.3))
    error = cal.to_mm(to_px(WORLD_TO_PX, INSIDE_MM)) - INSIDE_MM
    # 0.3 px are 0.075 mm; 40 coordinates for 8 unknowns leave about half of that
    assert np.sqrt(np.mean(error**2)) < 0.075
    # expected rms distance: 0.3 sqrt(2 (40 - 8) / 40) = 0.38 px; with the luck of 32 degrees of freedom
    assert cal.residual_px == pytest.approx(0.38, rel=0.35)
    residual = cal.points[["residual_x_px", "residual_y_px"]].to_numpy()
    assert np.sqrt(np.mean(np.sum(residual**2, axis=1))) == pytest.approx(cal.residual_px)


def test_mapping_there_and_back_is_exact_for_any_shape(calibrated):
    cal = calibrated(control_points=points_of(WORLD_TO_PX))
    rng = np.random.default_rng(0)
    for shape in ((2,), (0, 2), (7, 2), (3, 4, 2)):
        px = rng.uniform(0, 900, shape)
        back = cal.to_px(cal.to_mm(px))
        assert back.shape == shape
        np.testing.assert_allclose(back, px, atol=1e-9)


def test_four_points_are_said_to_hide_a_slip_and_five_are_not(calibrated):
    # any four places fit some camera: 10 mm typed wrong leave no residual
    corners = np.array([[0.0, 0.0], [120.0, 0.0], [120.0, 80.0], [0.0, 80.0], [60.0, 40.0]])
    four, five = (points_of(WORLD_TO_PX, corners[:n], noise=0.3) for n in (4, 5))
    four[2] = [*four[2][:2], four[2][2] + 10.0, four[2][3]]
    found = calibrated(control_points=four)
    assert found.residual_px < 1e-6
    assert any("cannot be noticed" in text for text in found.warnings)
    assert not any("cannot be noticed" in text for text in calibrated(control_points=five).warnings)


def test_four_points_nearly_on_a_line_are_said_to_tell_the_scale_poorly(calibrated, caplog):
    line = np.array([[0.0, 10.0], [60.0, 18.0], [120.0, 10.0], [90.0, 8.0]])
    cal = calibrated(control_points=points_of(WORLD_TO_PX, line))
    assert cal.scale_std > 0.02
    (poor,) = (text for text in cal.warnings if "% only: spread the points" in text)
    assert poor in caplog.text
    assert calibrated(control_points=points_of(WORLD_TO_PX, noise=0.3)).warnings == ()


def test_a_mirrored_camera_gives_travel_to_the_left(calibrated):
    matrix = MIRROR @ WORLD_TO_PX
    cal = calibrated(control_points=points_of(matrix))
    assert cal.direction == "left"
    np.testing.assert_allclose(cal.to_mm(to_px(matrix, INSIDE_MM)), INSIDE_MM, atol=1e-6)


def test_scale_at_the_tip_is_the_local_one(calibrated):
    cal = calibrated(control_points=points_of(WORLD_TO_PX))
    h = 1e-3
    px = to_px(WORLD_TO_PX, [[h, 0], [-h, 0], [0, h], [0, -h]])
    local = np.array([px[0] - px[1], px[2] - px[3]]) / (2 * h)
    assert cal.mm_per_px == pytest.approx(1 / np.sqrt(abs(np.linalg.det(local))), rel=1e-6)


def test_the_uncertainty_of_the_scale_is_its_scatter():
    px = to_px(WORLD_TO_PX, GRID_MM)
    rng, std_px = np.random.default_rng(5), np.full(len(px), 0.5)
    fits = [
        fit_camera(PointSet(px + rng.normal(0, 0.5, px.shape), GRID_MM, SHAPE, std_px)) for _ in range(200)
    ]
    scales = [scale_at_origin(fit.model, fit.spread) for fit in fits]
    # three standard errors of 200 draws
    scatter = np.std([np.log(scale) for scale, _ in scales])
    assert scatter == pytest.approx(np.median([std for _, std in scales]), rel=0.15)


@pytest.mark.parametrize(
    ("mm", "named"),
    [
        ([[0, 0], [10, 10], [20, 20], [30, 30], [50, 50]], "on one line"),
        ([[0, 0], [0, 0], [0, 0], [0, 0]], "on one line"),
        ([[0, 0], [50, 0], [100, 0], [50, 80]], "do not fix a homography"),
        ([[0, 0], [50, 0], [50, 0], [50, 80]], "do not fix a homography"),
    ],
)
def test_points_that_fix_nothing_are_refused_with_the_reason(calibrated, mm, named):
    with pytest.raises(CalibrationError, match=named):
        calibrated(control_points=points_of(WORLD_TO_PX, np.array(mm, float)))


@pytest.mark.parametrize("count", [6, 8, 20])
@pytest.mark.parametrize("wrong", [0, 3, 5])
def test_a_single_mistyped_point_is_named(calibrated, count, wrong):
    chosen = GRID_MM[[0, 4, 15, 19, 7, 13, 2, 17]][:count] if count < 20 else GRID_MM
    points = points_of(WORLD_TO_PX, chosen, noise=0.2)
    points[wrong][2] += 20.0  # 20 mm off
    with pytest.raises(CalibrationError, match=rf"control_points\.{wrong}: ") as caught:
        calibrated(control_points=points)
    told = float(str(caught.value).split("x_mm = ")[1].split(",")[0])
    assert told == pytest.approx(chosen[wrong][0], abs=1.0)


def test_no_point_is_blamed_for_noise(calibrated):
    for seed in range(20):
        noise = np.random.default_rng(seed).normal(0, 0.5, (20, 2))
        points = np.hstack([to_px(WORLD_TO_PX, GRID_MM) + noise, GRID_MM])
        assert calibrated(control_points=points.tolist()).residual_px < 1.5


def test_contradictions_in_direction_are_refused(calibrated):
    with pytest.raises(CalibrationError, match=r"travels to the right, but direction is left"):
        calibrated(control_points=points_of(WORLD_TO_PX), direction="left")
    downwards = [[u, v, x, -y] for u, v, x, y in points_of(WORLD_TO_PX)]
    with pytest.raises(CalibrationError, match="y is up"):
        calibrated(control_points=downwards)
    swapped = [[u, v, y, x] for u, v, x, y in points_of(WORLD_TO_PX)]
    with pytest.raises(CalibrationError, match="order of x_mm and y_mm"):
        calibrated(control_points=swapped)


def picture_of(pattern, mm_per_texel, board_to_px, shape=SHAPE):
    """A board's print seen by a camera: pixels are means over 4 x 4 exactly mapped samples."""
    fine = 4
    y, x = np.mgrid[: shape[0] * fine, : shape[1] * fine].astype(np.float32)
    px = np.stack([(x + 0.5) / fine - 0.5, (y + 0.5) / fine - 0.5, np.ones_like(x)])
    mm = np.einsum("ij,jhw->ihw", np.linalg.inv(board_to_px).astype(np.float32), px)
    u, v = mm[0] / mm[2] / mm_per_texel - 0.5, mm[1] / mm[2] / mm_per_texel - 0.5
    seen = cv2.remap(pattern, u, v, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=255)
    return cv2.resize(seen, shape[::-1], interpolation=cv2.INTER_AREA)


# the board lies in the window plane, turned by 3 degrees against the rows and seen askew
BOARD_TO_PX = np.array([[4.0, -0.21, 300.0], [0.21, 4.0, 200.0], [1e-4, 6e-5, 1.0]])
TIP_PX = [350.0, 640.0]


def chessboard(squares_x, squares_y, side, margin):
    rows, columns = np.mgrid[:squares_y, :squares_x]
    board = np.kron(((rows + columns) % 2 * 255).astype(np.uint8), np.ones((side, side), np.uint8))
    return cv2.copyMakeBorder(board, *[margin] * 4, cv2.BORDER_CONSTANT, value=255)


def world_of(board_mm, tip_px, sign):
    """World mm of places on the board: origin at the tip, x along the rows there, y up."""
    place = np.linalg.inv(BOARD_TO_PX)
    tip, ahead = (to_px(place, [p])[0] for p in (tip_px, [tip_px[0] + 1e-3 * sign, tip_px[1]]))
    along = (ahead - tip) / np.linalg.norm(ahead - tip)
    up = np.array([along[1], -along[0]]) * sign  # board y is down, seen from its front
    return (board_mm - tip) @ np.column_stack([along, up])


def check_board(cal, sign, tolerance_mm):
    inside = np.random.default_rng(8).uniform([10, 10], [150, 90], (40, 2))
    found = cal.to_mm(to_px(BOARD_TO_PX, inside))
    error = found - world_of(inside, TIP_PX, sign)
    assert np.sqrt(np.mean(np.sum(error**2, axis=1))) < tolerance_mm
    np.testing.assert_allclose(cal.to_mm(np.array(TIP_PX)), [0, 0], atol=1e-6)
    assert cal.direction.sign == sign


@pytest.mark.parametrize(("direction", "sign"), [("right", 1), ("left", -1)])
def test_a_chessboard_places_points_within_0p02_mm(calibrated, tmp_path, direction, sign):
    # squares of 16 mm printed at 0.25 mm a texel, a rim of 16 mm: the first inner corner is at (0, 0)
    board = np.array([[1, 0, -32.0], [0, 1, -32.0], [0, 0, 1]])
    image = picture_of(chessboard(11, 8, 64, 64), 0.25, BOARD_TO_PX @ board)
    Image.fromarray(image).save(tmp_path / "board.png")
    cal = calibrated(
        board={"kind": "chessboard", "picture": "board.png", "columns": 10, "rows": 7, "spacing_mm": 16.0},
        tip_px=TIP_PX,
        direction=direction,
    )
    check_board(cal, sign, 0.02)
    assert len(cal.points) == 70
    assert cal.residual_px < 0.06  # corners within 0.04 px in each coordinate


def test_travel_on_a_board_goes_where_the_tip_is_said_to_go(calibrated, cameras, tmp_path):
    # the camera looks from the right and from above: level lines converge in the picture
    camera = cameras.made_camera(tilt_deg=(6, -5), shape=SHAPE)
    level = np.array([[0.0, 0.0], [150.0, 0.0]])
    tip_px, later_px = camera.photograph(level)
    pattern = chessboard(11, 8, 64, 64)

    def paint(mm):
        u, v = (mm[:, 0] + 8.0) / 0.25, (108.0 - mm[:, 1]) / 0.25
        inside = (u >= 0) & (v >= 0) & (u < pattern.shape[1]) & (v < pattern.shape[0])
        column, row = (
            x.clip(0, side - 1).astype(int) for x, side in zip((u, v), pattern.shape[::-1], strict=True)
        )
        return np.where(inside, pattern[row, column] / 255, 1.0)

    Image.fromarray(cameras.photographed(camera, paint, noise=1.0)).save(tmp_path / "board.png")
    board = {"kind": "chessboard", "picture": "board.png", "columns": 10, "rows": 7, "spacing_mm": 16.0}
    frames = {"board": board, "tip_px": tip_px.tolist()}
    inside = np.random.default_rng(8).uniform([0, 0], [150, 90], (40, 2))
    seen_px = camera.photograph(inside)
    told = calibrated(travel_px=later_px.tolist(), **frames)
    assert np.abs(told.to_mm(seen_px) - inside).max() < 0.05
    assert told.warnings == ()
    guessed = calibrated(**frames)
    off = guessed.to_mm(seen_px) - inside
    assert np.hypot(*off.T).max() > 1.0  # half a degree and more over 175 mm
    assert "Give camera.travel_px" in guessed.warnings[0]
    assert np.hypot(*guessed.std_mm(seen_px).T).max() > 0.4 * np.hypot(*off.T).max()


@pytest.mark.parametrize("legacy", [False, True])
def test_a_charuco_board_places_points_within_0p02_mm(calibrated, tmp_path, legacy):
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    pattern = cv2.aruco.CharucoBoard((8, 6), 20.0, 15.0, dictionary)
    pattern.setLegacyPattern(legacy)
    image = picture_of(pattern.generateImage((640, 480)), 0.25, BOARD_TO_PX)
    image[:230, :420] = 255  # a corner of the board is hidden
    Image.fromarray(image).save(tmp_path / "board.png")
    cal = calibrated(
        board={
            "kind": "charuco",
            "picture": "board.png",
            "columns": 8,
            "rows": 6,
            "spacing_mm": 20.0,
            "marker_mm": 15.0,
        },
        tip_px=TIP_PX,
    )
    check_board(cal, 1, 0.02)
    assert 20 <= len(cal.points) < 35


@pytest.mark.parametrize("negative", [False, True])
def test_a_grid_of_dots_places_points_within_0p02_mm(calibrated, tmp_path, negative):
    pattern = np.full((500, 760), 255, np.uint8)
    for row in range(7):
        for column in range(11):
            centre = (60 + 64 * column, 60 + 60 * row + 4 * row)
            cv2.circle(pattern, (16 * centre[0], 16 * centre[1]), 16 * 18, 0, -1, cv2.LINE_8, 4)
    board = np.array([[1, 0, -60.5 / 4], [0, 1, -60.5 / 4], [0, 0, 1]])  # texel centres at + 0.5
    image = picture_of(pattern, 0.25, BOARD_TO_PX @ board)
    Image.fromarray(255 - image if negative else image).save(tmp_path / "board.png")
    cal = calibrated(
        board={"kind": "dots", "picture": "board.png", "columns": 11, "rows": 7, "spacing_mm": 16.0},
        tip_px=TIP_PX,
    )
    check_board(cal, 1, 0.02)
    assert len(cal.points) == 77


def test_boards_that_cannot_be_used_are_refused_by_name(calibrated, tmp_path):
    keys = {"kind": "chessboard", "columns": 10, "rows": 7, "spacing_mm": 16.0}
    Image.fromarray(np.full(SHAPE, 128, np.uint8)).save(tmp_path / "grey.png")
    Image.fromarray(np.full((50, 60), 128, np.uint8)).save(tmp_path / "small.png")
    (tmp_path / "text.png").write_text("x")
    for picture, error, text in (
        ("grey.png", CalibrationError, "no chessboard board of 10 x 7 found"),
        ("small.png", CalibrationError, "60 x 50 px; expected 1400 x 900 px"),
        ("text.png", DataError, "not a picture"),
    ):
        with pytest.raises(error, match=text) as caught:
            calibrated(board={**keys, "picture": picture}, tip_px=TIP_PX)
        assert picture in str(caught.value)
    charuco = {**keys, "kind": "charuco", "picture": "grey.png"}
    with pytest.raises(CalibrationError, match="marker_mm"):
        calibrated(board=charuco, tip_px=TIP_PX)
    with pytest.raises(CalibrationError, match="dictionary"):
        calibrated(board={**charuco, "marker_mm": 9.0, "dictionary": "DICT_NONE"}, tip_px=TIP_PX)


def test_an_uncertainty_on_the_window_alone_is_not_passed_over(make_scene):
    with pytest.raises(ValueError, match=r"points_std_px: got nothing; expected a value with points_std_mm"):
        make_scene(control_points=points_of(WORLD_TO_PX), points_std_mm=0.1)


def test_the_uncertainty_of_places_on_the_window_counts_in_px(calibrated):
    given = points_of(WORLD_TO_PX, noise=0.3)
    alone, both = (
        calibrated(control_points=given, points_std_px=0.3, points_std_mm=std) for std in (0.0, 0.1)
    )
    # 3.9 px/mm over the points, so 0.1 mm are 0.39 px
    assert both.std_px == pytest.approx(np.hypot(0.3, 0.39), rel=0.03)
    np.testing.assert_allclose(
        both.std_mm(np.array([700.0, 450.0])) / alone.std_mm(np.array([700.0, 450.0])),
        both.std_px / alone.std_px,
        rtol=0.1,
    )


def test_local_scale_and_uncertainty_have_the_shape_that_is_asked(calibrated):
    cal = calibrated(control_points=points_of(WORLD_TO_PX, noise=0.3))
    px = np.random.default_rng(1).uniform(0, 900, (3, 4, 2))
    assert cal.mm_per_px_at(px).shape == (3, 4)
    assert cal.std_mm(px).shape == (3, 4, 2)
    right, down = np.array([0.01, 0.0]), np.array([0.0, 0.01])
    steps = cal.to_mm(px + right) - cal.to_mm(px - right), cal.to_mm(px + down) - cal.to_mm(px - down)
    area = np.abs(steps[0][..., 0] * steps[1][..., 1] - steps[0][..., 1] * steps[1][..., 0]) / 0.02**2
    np.testing.assert_allclose(cal.mm_per_px_at(px), np.sqrt(area), rtol=1e-6)


@pytest.mark.parametrize("kind", ["scattered", "repeated", "unit", "in line", "careless"])
def test_control_points_of_any_kind_are_used_or_refused(make_scene, kind):
    for seed in range(6):
        rng = np.random.default_rng(seed)
        count = int(rng.integers(4, 9))
        px = rng.uniform(0, [1400, 900], (count, 2))
        mm = (px - [300, 700]) * [0.2, -0.2]
        if kind == "scattered":
            mm = rng.uniform(-20, 200, (count, 2))
        elif kind == "repeated":
            mm[0] = mm[1]
        elif kind == "unit":
            mm = mm * 10.0 ** rng.integers(-9, 9)
        elif kind == "in line":
            px[:, 1] = 500 + rng.normal(0, 2, count)
        else:
            mm = mm + rng.normal(0, 3, mm.shape)
        pane = {"thickness_mm": 20.0, "distance_mm": 300.0, "points_on": ["outside", "inside"][seed % 2]}
        given = {"control_points": np.hstack([px, mm]).tolist(), **({"window": pane} if seed % 3 else {})}
        try:
            found = calibrate(make_scene(**given), SimpleNamespace(shape=SHAPE))
        except CalibrationError:
            continue  # any other exception, or a warning, fails
        assert np.isfinite(found.std_mm(px)).all()
        assert found.mm_per_px > 0
