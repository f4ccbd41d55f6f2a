"""The blade's face in drawn photographs, against where it was drawn."""

import numpy as np
import pytest

from ploughval.axes import Direction
from ploughval.scene import Blade
from ploughval.tracers.blade import BladeFinder
from ploughval.tracers.view import View

TRAVEL = [0.0, 0.0, 1.37, 2.94, 4.41, 9.83, 11.2]  # mm, 0.2 mm per px; a jump of 27 px among them


def heap(u):
    return lambda x: 25.0 + 8.0 * np.clip(1 - (x - u) / 30.0, 0, 1)


def follow(stage, photographs):
    view = View(stage.shape, stage.calibration)
    cuts = [view.cut(p) for p in photographs]
    finder = BladeFinder(view, Blade(depth_mm=25, width_mm=200, thickness_mm=4), cuts[0])
    seen = [finder.find(cut) for cut in cuts]
    return np.array([view.x_mm(s.column) for s in seen]) / view.step_mm, np.array([s.std_px for s in seen])


@pytest.mark.parametrize("direction", list(Direction))
@pytest.mark.parametrize("look", [{}, {"vignetting": 0.3}, {"air": 200.0, "blade": 40.0}])
def test_the_face_is_found_within_0p2_px(stage, direction, look):
    drawn = stage(direction=direction, **look)
    x_px, std_px = follow(drawn, [drawn.draw(u, heap(u), seed=k) for k, u in enumerate(TRAVEL)])
    error = x_px - np.array(TRAVEL) / drawn.mm_per_px
    assert np.sqrt(np.mean(error**2)) < 0.2  # the figure to reach
    assert (np.abs(error) < 4 * std_px + 0.1).all()
    assert (std_px < 0.2).all()


def test_a_blade_as_grey_as_the_air_is_found_by_the_sand_before_it(stage):
    drawn = stage(air=60.0, blade=62.0)
    u = np.arange(0, 8.0, 1.3)
    x_px, _ = follow(drawn, [drawn.draw(v, heap(v), seed=k) for k, v in enumerate(u)])
    assert np.abs(x_px - u / drawn.mm_per_px).max() < 0.5


def test_a_picture_without_blade_gives_nan_and_the_next_is_found_again(stage):
    drawn = stage()
    blank = np.full(drawn.shape, 90, np.uint8)
    photographs = [drawn.draw(u, heap(u), seed=7) for u in (0.0, 1.0, 2.0)]
    x_px, std_px = follow(drawn, [*photographs, blank, drawn.draw(4.0, heap(4.0), seed=8)])
    assert np.isnan(x_px[3])
    assert np.isnan(std_px[3])
    assert x_px[4] == pytest.approx(20.0, abs=0.2)
