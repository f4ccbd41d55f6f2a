"""Many scenes at once: the same numbers for any number of threads, errors in their places, closed forms."""

import numpy as np
import pytest

from ploughval.errors import ConfigError, ConvergenceError, PloughvalError
from ploughval.model import ForceHistory, force_history, simulate_many
from ploughval.scene import Scene

DEPTH_MM, WIDTH_MM = 30.0, 218.0


def scene(peak=50.0, residual=32.0, *, model=None, box=None, gamma=16.0, depth=DEPTH_MM) -> Scene:
    tables = {
        "test": {"name": "batch"},
        "blade": {"depth_mm": depth, "width_mm": WIDTH_MM},
        "soil": {
            "unit_weight_kN_m3": gamma,
            "peak_friction_deg": peak,
            "residual_friction_deg": residual,
            "mobilization_length_mm": 1.0,
        },
        "model": model or {},
    }
    if box is not None:
        tables["box"] = {"length_mm": box}
    return Scene.model_validate(tables)


def drawn_scenes(count: int) -> list[Scene]:
    """Sands between 33 and 50 degrees, dense and loose, at depths from 5 to 80 mm."""
    draw = np.random.default_rng(3).uniform(size=(count, 4))
    peak, share, gamma, depth = (draw * [17.0, 1.0, 4.0, 75.0] + [33.0, 0.0, 13.0, 5.0]).T
    residual = 25.0 + share * (peak - 25.0)
    return [
        scene(*row[:2], gamma=row[2], depth=row[3])
        for row in np.column_stack([peak, residual, gamma, depth]).tolist()
    ]


def histories(scenes: list[Scene], **options) -> list[ForceHistory]:
    runs = simulate_many(scenes, **options)
    assert all(isinstance(run, ForceHistory) for run in runs)
    return [run for run in runs if isinstance(run, ForceHistory)]


@pytest.mark.parametrize("workers", [2, 5])
def test_numbers_do_not_depend_on_the_number_of_threads(workers):
    scenes = drawn_scenes(60)
    alone, together = histories(scenes), histories(scenes, workers=workers)
    assert len(together) == len(scenes)
    for one, other in zip(alone, together, strict=True):
        for column, same in zip(one, other, strict=True):
            np.testing.assert_array_equal(column, same)


def test_every_run_starts_at_the_passive_force_of_its_own_sand():
    """Rankine's K gamma d^2 / 2 to rounding: order, soils and depths are not mixed up between threads."""
    scenes = drawn_scenes(60)
    for given, run in zip(scenes, histories(scenes, workers=2), strict=True):
        assert given.soil is not None
        passive = np.tan(np.radians(45.0 + 0.5 * given.soil.peak_friction_deg)) ** 2
        weight = 1e-6 * given.soil.unit_weight_kN_m3 * given.blade.depth_mm**2 * WIDTH_MM
        assert run.force_N[0] == pytest.approx(0.5 * weight * passive, rel=1e-9)


def test_a_run_reaches_three_depths_or_the_travel_asked_for():
    scenes = [scene(), scene(depth=12.0), scene(model={"displacement_mm": 7.0})]
    assert [run.u_mm[-1] for run in histories(scenes)] == pytest.approx([90.0, 36.0, 7.0], rel=1e-12)
    assert [run.u_mm[-1] for run in histories(scenes, displacement_mm=11.0)] == pytest.approx([11.0] * 3)


def test_scene_and_argument_set_the_tolerance_alike():
    by_scene = histories([scene(model={"tolerance": 0.02})])[0]
    by_argument = histories([scene()], tolerance=0.02)[0]
    np.testing.assert_array_equal(by_scene.force_N, by_argument.force_N)
    assert len(by_argument.u_mm) < len(force_history(scene()).u_mm)


def test_a_scene_that_cannot_be_modelled_gives_its_error_in_its_place():
    soilless = scene().model_copy(update={"soil": None})
    short, hollow = scene(box=20.0), scene(model={"initial_surface_mm": [[0.0, -5.0], [100.0, 30.0]]})
    runs = simulate_many([scene(), soilless, short, scene(36.0, 32.0), hollow], workers=2)
    kinds = [type(run) for run in runs]
    assert kinds == [ForceHistory, ConfigError, ConvergenceError, ForceHistory, ConfigError]
    messages = [str(run) for run in runs if isinstance(run, PloughvalError)]
    for message, words in zip(messages, ("[soil]", "end of the box", "height -5.0"), strict=True):
        assert words in message


def test_nothing_in_nothing_out():
    assert simulate_many([]) == ()
    assert simulate_many(iter([]), workers=3) == ()


def test_impossible_options_are_refused():
    with pytest.raises(ConfigError, match="tolerance"):
        simulate_many([scene()], tolerance=-1.0)
    with pytest.raises(ConfigError, match="workers"):
        simulate_many([scene()], workers=0)
