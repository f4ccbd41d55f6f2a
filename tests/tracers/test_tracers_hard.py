"""What befalls photographs: flicker, reflections, dark sand, hands, knocks; against what was drawn."""

import cv2
import numpy as np
import pytest

from ploughval.axes import Direction, Region
from ploughval.tracers import Watcher

LAYERS = (8.0, 16.0)
TRAVEL = (0.0, 1.5, 3.0, 4.5, 6.0)  # mm; 0.2 mm a pixel


def heap(u):
    """A crest before the face and a slope that meets the still sand 14 to 21 mm ahead of it."""
    place, height = np.array([[0.0, 25 + 1.1 * u], [5.0 + u, 25 + 1.1 * u], [14.0 + 2 * u, 25.0]]).T
    return lambda x: np.interp(x - u, place, height)


def photographs(drawn, seed=20):
    still = [lambda x, h=h: np.full_like(x, h) for h in LAYERS]
    return [drawn.draw(u, heap(u), seed=seed + k, layers=still) for k, u in enumerate(TRAVEL)]


def grey(values):
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def watch(drawn, pictures, shifts=None):
    watcher = Watcher(drawn.scene, drawn.calibration)
    shifts = shifts or [(0.0, 0.0)] * len(pictures)
    return [watcher.see(k, p, shift_px=s) for k, (p, s) in enumerate(zip(pictures, shifts, strict=True))]


def check(drawn, sight, u, *, surface_px=0.5, blade_px=0.2, seen=0.95):
    """The figures to reach: surface rms 0.5 px, face 0.2 px, dyed layers median 0.5 px, 95 % within 2 px."""
    line, scale = sight.surface_mm, drawn.mm_per_px
    error = (line[:, 1] - heap(u)(line[:, 0])) / scale
    assert np.sqrt(np.mean(error**2)) < surface_px
    assert len(line) * 2 * scale > seen * (91.8 - u)
    assert abs(sight.blade_x_mm - u) / scale < blade_px
    for height in LAYERS:
        off = np.abs(sight.dyed[height][:, 1] - height) / scale
        assert np.nanmedian(off) < 0.5
        assert np.nanpercentile(off, 95) < 2.0
        assert np.isfinite(off).sum() > 0.75 * (91.8 - u) / scale / 2


def over_picture(shape, across, down):
    """Light that changes by these shares from one side of the picture to the other."""
    y, x = np.mgrid[-0.5 : 0.5 : shape[0] * 1j, -0.5 : 0.5 : shape[1] * 1j]
    return 1 + across * x + down * y


def streak(shape, strength=50.0):
    """A slanting streak of reflected light, 12 px wide."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    return strength * np.exp(-(((x - 280 - 0.25 * (y - 115)) / 6) ** 2))


@pytest.mark.parametrize("direction", list(Direction))
def test_flicker_of_a_tenth_with_slow_gradients(stage, direction):
    drawn = stage(direction=direction, layers=LAYERS)
    light = [(1.0, 0.0, 0.0), (0.9, 0.08, 0.0), (1.1, -0.05, 0.1), (0.95, 0.1, -0.1), (1.1, 0.0, 0.05)]
    pictures = [
        grey(p * (level * over_picture(p.shape, across, down)))
        for p, (level, across, down) in zip(photographs(drawn), light, strict=True)
    ]
    for u, sight in zip(TRAVEL, watch(drawn, pictures), strict=True):
        check(drawn, sight, u)
        assert sight.reasons == ()


@pytest.mark.parametrize("light", [(0.3, 0.0), (-0.3, 0.0), (0.0, 0.3)])
def test_light_from_one_side(stage, light):
    drawn = stage(layers=LAYERS)
    pictures = [grey(p * over_picture(p.shape, *light)) for p in photographs(drawn)]
    for u, sight in zip(TRAVEL, watch(drawn, pictures), strict=True):
        check(drawn, sight, u)


def test_a_reflection_on_the_window(stage):
    drawn = stage(layers=LAYERS)
    pictures = [grey(p + streak(p.shape)) for p in photographs(drawn)]
    for u, sight in zip(TRAVEL, watch(drawn, pictures), strict=True):
        check(drawn, sight, u)


@pytest.mark.parametrize(
    ("look", "turned"),
    [
        ({"air": 20.0, "blade": 160.0}, 60.0),  # turned over: sand of mean grey 60, background 170, blade 30
        ({"air": 40.0, "blade": 170.0}, None),
        ({"air": 60.0, "blade": 62.0}, None),  # the blade as dark as the background
    ],
)
def test_dark_and_pale_sand_and_a_blade_like_the_background(stage, look, turned):
    drawn = stage(layers=LAYERS, **look)
    pictures = photographs(drawn)
    if turned is not None:
        pictures = [grey(turned + 130.0 - p) for p in pictures]
    for u, sight in zip(TRAVEL, watch(drawn, pictures), strict=True):
        check(drawn, sight, u, blade_px=0.4 if look["blade"] == 62.0 else 0.2)


def covered(picture, level):
    """A smooth dark or skin-grey blob over a third of the picture, with noise."""
    height, width = picture.shape
    mask = np.zeros(picture.shape, np.uint8)
    x = 0.5 * width
    cv2.ellipse(mask, (int(x), int(0.4 * height)), (int(0.2 * width), int(0.75 * height)), 12, 0, 360, 1, -1)
    rng = np.random.default_rng(5)
    shade = cv2.GaussianBlur(rng.standard_normal(picture.shape), (0, 0), 25)
    hand = level + 15 * shade / shade.std() + rng.normal(0, 1.5, picture.shape)
    return np.where(mask > 0, grey(hand), picture)


@pytest.mark.parametrize("direction", list(Direction))
@pytest.mark.parametrize("level", [30.0, 150.0])
def test_a_hand_hides_the_surface_and_the_next_picture_is_right(stage, level, direction):
    drawn = stage(direction=direction, layers=LAYERS)
    pictures = photographs(drawn)
    pictures[3] = covered(pictures[3], level)
    sights = watch(drawn, pictures)
    hidden = sights[3]
    assert any(reason.startswith("surface:") for reason in hidden.reasons)
    line = hidden.surface_mm
    assert len(line) * 0.4 < 0.75 * (91.8 - TRAVEL[3])
    error = (line[:, 1] - heap(TRAVEL[3])(line[:, 0])) / drawn.mm_per_px
    assert np.sqrt(np.mean(error**2)) < 1.0  # what is still said is right
    for k in (2, 4):
        check(drawn, sights[k], TRAVEL[k])
        assert sights[k].reasons == ()


@pytest.mark.parametrize("level", [30.0, 150.0])
def test_a_hand_that_stays_is_not_taken_for_the_surface(stage, level):
    drawn = stage(layers=LAYERS)
    pictures = photographs(drawn)
    for k in (1, 2, 3):
        pictures[k] = covered(pictures[k], level)
    sights = watch(drawn, pictures)
    for k in (1, 2, 3):
        line = sights[k].surface_mm
        error = (line[:, 1] - heap(TRAVEL[k])(line[:, 0])) / drawn.mm_per_px
        assert np.sqrt(np.mean(error**2)) < 1.0
        assert any(reason.startswith("surface:") for reason in sights[k].reasons)
    check(drawn, sights[4], TRAVEL[4])


def test_a_hand_over_the_blade_leaves_it_unknown_for_that_picture(stage):
    drawn = stage(layers=LAYERS)
    pictures = photographs(drawn)
    spoilt = pictures[2].copy()
    spoilt[:, :160] = grey(120 + np.random.default_rng(1).normal(0, 1.5, (spoilt.shape[0], 160)))
    pictures[2] = spoilt
    sights = watch(drawn, pictures)
    assert np.isnan(sights[2].blade_x_mm)
    assert np.isnan(sights[2].blade_std_mm)
    assert "blade: the face was not found" in sights[2].reasons
    for k in (3, 4):
        check(drawn, sights[k], TRAVEL[k])


@pytest.mark.parametrize(
    "spoil", [lambda p: grey(p * 1.7), lambda p: cv2.GaussianBlur(p, (0, 0), 2.5)], ids=["over", "blurred"]
)
def test_one_overexposed_or_blurred_picture_does_not_spoil_the_next(stage, spoil):
    drawn = stage(layers=LAYERS)
    pictures = photographs(drawn)
    pictures[2] = spoil(pictures[2])
    sights = watch(drawn, pictures)
    line = sights[2].surface_mm
    error = (line[:, 1] - heap(TRAVEL[2])(line[:, 0])) / drawn.mm_per_px
    assert np.median(np.abs(error)) < 1.0
    for k in (1, 3, 4):
        check(drawn, sights[k], TRAVEL[k])


@pytest.mark.parametrize("direction", list(Direction))
@pytest.mark.parametrize("shift", [(3.0, -2.0), (-2.4, 1.7), (0.0, 3.3)])
def test_a_knock_of_the_camera_is_taken_off(stage, shift, direction):
    """The pictures are moved by cubic interpolation; the world does not move with them."""
    drawn = stage(direction=direction, layers=LAYERS)
    pictures = photographs(drawn)
    move = np.float32([[1, 0, shift[0]], [0, 1, shift[1]]])
    size = pictures[0].shape[::-1]
    for k in (2, 3, 4):
        pictures[k] = cv2.warpAffine(
            pictures[k], move, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
        )
    sights = watch(drawn, pictures, [(0.0, 0.0)] * 2 + [shift] * 3)
    for u, sight in zip(TRAVEL, sights, strict=True):
        check(drawn, sight, u)
    plain = watch(drawn, photographs(drawn))[4].regions
    whole = np.rint(shift).astype(int)
    inside = (slice(8, -8), slice(8, -8))
    moved = np.roll(plain, whole[::-1], axis=(0, 1))
    assert np.mean(sights[4].regions[inside] != moved[inside]) < 0.01


@pytest.mark.parametrize("direction", list(Direction))
def test_regions_name_every_pixel(stage, direction):
    drawn = stage(direction=direction)
    u = TRAVEL[4]
    sight = watch(drawn, photographs(drawn))[4]
    rows, cols = np.mgrid[: drawn.shape[0], : drawn.shape[1]]
    x, y = np.moveaxis(drawn.calibration.to_mm(np.stack([cols, rows], axis=-1)), -1, 0)
    expected = np.full(drawn.shape, Region.AIR)
    expected[(y < heap(u)(x)) & (x > u)] = Region.SAND
    expected[(x <= u) & (y >= 0)] = Region.BLADE
    expected[(x < u - 4.0) & (y >= 0)] = Region.TRENCH
    expected[y < 0] = Region.SAND
    assert np.mean(sight.regions != expected) < 0.006  # one pixel along every border
    assert np.array_equal(sight.sand, sight.regions == Region.SAND)
    assert sight.regions.dtype == np.uint8


class Tilted:
    """A camera that looks at a drawn test askew: its pictures are the drawn ones in perspective."""

    def __init__(self, calibration):
        self._flat = calibration
        self.mm_per_px = calibration.mm_per_px
        self.matrix = np.array([[0.999, -0.03, 9.0], [0.03, 0.999, -4.0], [2e-5, 1e-5, 1.0]])

    def to_px(self, mm):
        return self._through(self.matrix, self._flat.to_px(mm))

    def to_mm(self, px):
        return self._flat.to_mm(self._through(np.linalg.inv(self.matrix), np.asarray(px, float)))

    @staticmethod
    def _through(matrix, px):
        ahead = np.concatenate([px, np.ones((*px.shape[:-1], 1))], axis=-1) @ matrix.T
        return ahead[..., :2] / ahead[..., 2:]


def test_a_camera_that_looks_askew_sees_the_same(stage):
    """Both the warp of the pictures and the watcher's grid are bilinear or better; the figures hold."""
    drawn = stage(layers=LAYERS)
    tilted = Tilted(drawn.calibration)
    watcher = Watcher(drawn.scene, tilted)
    for k, (u, picture) in enumerate(zip(TRAVEL, photographs(drawn), strict=True)):
        seen = cv2.warpPerspective(
            picture,
            tilted.matrix,
            picture.shape[::-1],
            flags=cv2.INTER_CUBIC,
            borderMode=cv2.BORDER_REPLICATE,
        )
        check(drawn, watcher.see(k, seen), u, seen=0.85)
