"""Fixed markers of a scene: what they are called, and that no sand is seen where they are painted."""

import numpy as np
import pytest

from ploughval.axes import Region
from ploughval.piv import CameraMovement
from ploughval.run.walk.steadied import FixedMarkers
from ploughval.scene import Camera
from ploughval.synth.discs import disc_cover

PLACES = [(40.0, 40.0), (200.0, 45.0), (45.0, 150.0), (205.0, 155.0), (120.0, 30.0)]


@pytest.fixture
def image():
    rng = np.random.default_rng(0)
    picture = np.full((190, 250), 150.0)
    for place in PLACES[:4]:  # the fifth is not painted
        for radius, grey in ((12.0, 210.0), (6.0, 50.0)):
            cover = disc_cover(picture.shape, place, radius)
            picture = picture * (1 - cover) + cover * grey
    return np.rint(picture + rng.standard_normal(picture.shape)).astype(np.uint8)


@pytest.fixture
def camera():
    points = [(x + 2, y - 1, 0.1 * x, -0.1 * y) for x, y in PLACES[:4]]
    return Camera(
        photos="*.png",
        control_points=points,
        markers={"radius_px": 6.0, "fixed_px": [PLACES[4]], "disc_px": 13.0},
    )


def test_markers_are_named_as_in_the_settings(camera, image):
    start = FixedMarkers(camera, image).at_start()
    assert start.markers == 4
    assert len(start.missing) == 1
    assert start.missing[0].startswith("fixed marker 0: nothing round of radius 6 px")
    lost = np.full_like(image, 150)
    missing = FixedMarkers(camera, image).watch.see(lost).missing
    assert missing[0] == "control point 0 at (40, 40) px is not seen"


def test_painted_discs_are_no_sand_and_go_with_the_camera(camera, image):
    markers = FixedMarkers(camera, image)
    regions = np.full(image.shape, int(Region.SAND), np.uint8)
    moved = CameraMovement(np.array([7.0, -3.0]), 0.0, np.zeros(2), 0.0, 1.0)
    markers.hide(regions, moved)
    y, x = np.indices(image.shape)
    for px, py in PLACES[:4]:
        far = np.hypot(x - px - 7.0, y - py + 3.0)
        assert (regions[far < 12.8] == Region.OUTSIDE).all()
        assert (regions[(far > 13.2) & (far < 20)] == Region.SAND).all()
    assert (regions[20:40, 110:140] == Region.SAND).all()  # a marker that was not found hides nothing
