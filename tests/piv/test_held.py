"""Parts of pictures that are held in place of whole ones give the same fits."""

import numpy as np
import pytest

from ploughval.piv.held import Box, Current, Facing, Picture, Reference
from ploughval.piv.interpolate import plain_planes, spline_coefficients
from ploughval.piv.subsets import ALL_SEEN, Pair, Recipe, match

RECIPE = Recipe(31, 1, 5)


def pictures(sand):
    everywhere = np.ones(sand.shape, bool)
    return (
        Picture.taken(sand.picture(), everywhere),
        Picture.taken(sand.picture((7.3, -4.6), noise=1, seed=1), everywhere),
    )


def test_parts_of_pictures_match_as_whole_ones_do(sand):
    """What lies beyond 24 px changes the filters by less than 1e-7 of the grey levels."""
    points = sand.points(12, margin=60)[:40]
    first, second = pictures(sand)
    reference = Reference.held(0, first, points, np.zeros(len(points)), RECIPE)
    current = Current(second, 5)
    current.reach(points, 60.0)
    facing = Facing.of(reference, current, RECIPE, 1, 1.0)
    start = np.zeros((len(points), 2, 3))
    start[:, :, 0] = [7.0, -4.0]
    part = facing.match(np.arange(len(points)), start)
    whole = Pair(
        plain_planes(first.image, 5),
        first.sand,
        spline_coefficients(second.image, 5),
        ALL_SEEN,
        RECIPE,
        1,
        1.0,
    )
    expected = match(whole, points, start)
    assert reference.planes.value.size < 0.7 * first.image.size
    assert part.status.tolist() == expected.status.tolist() == [0] * len(points)
    assert np.abs(part.params - expected.params).max() < 1e-4


def test_current_part_grows_when_points_are_looked_for_elsewhere(sand):
    _, second = pictures(sand)
    current = Current(second, 5)
    current.reach(np.array([[60.0, 60.0]]), 30.0)
    small = current.coefficients.size
    current.reach(np.array([[180.0, 150.0]]), 30.0)
    assert current.coefficients.size > small
    assert current.corner.tolist() == [30.0, 30.0]
    grown = current.coefficients
    current.reach(np.array([[100.0, 100.0]]), 30.0)
    assert current.coefficients is grown  # inside what can be read already


def test_fit_goes_in_and_out_of_a_part_unchanged(sand):
    points = sand.points(30, margin=70)
    first, second = pictures(sand)
    reference = Reference.held(0, first, points, np.zeros(len(points)), RECIPE)
    current = Current(second, 5)
    current.reach(points, 50.0)
    facing = Facing.of(reference, current, RECIPE, 1, 0.0)
    start = np.zeros((len(points), 2, 3))
    start[:, :, 0] = [7.0, -4.0]
    fit = facing.match(np.arange(len(points)), start)
    assert np.allclose(facing.outward(facing.inward(fit)).params, fit.params, atol=1e-12)


@pytest.mark.parametrize(
    ("places", "expected"),
    [
        ([[50.0, 40.0], [80.0, 60.0]], (40, 30, 91, 71)),
        ([[-500.0, 40.0]], (0, 30, 16, 51)),
        ([[1e9, 1e9]], (244, 204, 260, 220)),
        ([[np.nan, 3.0]], (0, 0, 16, 16)),
    ],
)
def test_box_stays_inside_the_picture_and_is_never_empty(places, expected):
    box = Box.about(np.array(places), 10.0, (220, 260))
    assert (box.x0, box.y0, box.x1, box.y1) == expected
