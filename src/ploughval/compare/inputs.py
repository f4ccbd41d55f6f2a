"""Inputs of the model that carry a standard uncertainty, and draws of all of them together."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from ploughval.scene import Scene, Soil

Floats = NDArray[np.float64]
_SOIL = {
    "unit_weight_kN_m3": "unit_weight_std_kN_m3",
    "peak_friction_deg": "peak_friction_std_deg",
    "residual_friction_deg": "residual_friction_std_deg",
    "mobilization_length_mm": "mobilization_length_std_mm",
    "wall_friction_deg": "wall_friction_std_deg",
}
_LEAST_SHARE = 1e-3  # of a standard uncertainty: draws stay that far from a bound that is itself impossible


@dataclass(frozen=True, slots=True)
class Input:
    """An input of the model: its key, its value, its standard uncertainty and its least possible value."""

    name: str
    value: float
    std: float
    least: float


def uncertain_inputs(scene: Scene) -> tuple[Input, ...]:
    """Inputs of a scene with a standard uncertainty above 0, in a fixed order."""
    if scene.soil is None:
        return ()
    found = []
    for name, std_name in _SOIL.items():
        std = float(getattr(scene.soil, std_name))
        if std > 0:
            least = 0.0 if name in ("mobilization_length_mm", "wall_friction_deg") else _LEAST_SHARE * std
            found.append(Input(name, float(getattr(scene.soil, name)), std, least))
    depth, std = scene.blade.depth_mm, scene.blade.depth_std_mm
    if std > 0:
        found.append(Input("depth_mm", depth, std, 0.1 * depth))
    return tuple(found)


def changed_scene(scene: Scene, inputs: Sequence[Input], values: Floats) -> Scene | None:
    """A scene with other values of some inputs; None where the sand would be impossible.

    Parameters
    ----------
    scene : Scene
        With [soil].
    inputs : sequence of Input
        What changes.
    values : (K,) float
        The new values, in the inputs' units.
    """
    given = {one.name: float(value) for one, value in zip(inputs, values, strict=True)}
    depth = given.pop("depth_mm", scene.blade.depth_mm)
    assert scene.soil is not None
    soil = scene.soil.model_copy(update=given)
    if not _possible(soil):
        return None
    update: dict[str, object] = {"soil": soil}
    if depth != scene.blade.depth_mm:
        update["blade"] = scene.blade.model_copy(update={"depth_mm": depth})
        surface = scene.model.initial_surface_mm
        if surface is not None:  # heights above the tip: they rise as the tip goes deeper
            lifted = tuple((x, y + depth - scene.blade.depth_mm) for x, y in surface)
            update["model"] = scene.model.model_copy(update={"initial_surface_mm": lifted})
    return scene.model_copy(update=update)


def _possible(soil: Soil) -> bool:
    return (
        0 < soil.residual_friction_deg <= soil.peak_friction_deg
        and soil.peak_friction_deg + soil.wall_friction_deg < 90
    )


def draw_values(inputs: Sequence[Input], count: int, rng: np.random.Generator) -> Iterator[Floats]:
    """Draws of all inputs: a Latin hypercube of a number of rows, then single draws without end.

    Every input is normal, cut at its least possible value. In the hypercube each of ``count`` equally
    probable intervals of every input is met once (McKay, Beckman & Conover 1979), in an order that leaves
    next to no correlation between inputs (Iman & Conover 1982).

    Parameters
    ----------
    inputs : sequence of Input
        K inputs.
    count : int
        Rows of the hypercube.
    rng : numpy.random.Generator
        Source of all randomness.

    Yields
    ------
    (K,) float
        One value an input.
    """
    least = np.array([ndtr((one.least - one.value) / one.std) for one in inputs])
    values, stds = (np.array([getattr(one, name) for one in inputs]) for name in ("value", "std"))

    def of(probability: Floats) -> Floats:
        return np.asarray(values + stds * ndtri(least + (1 - least) * probability))

    strata = _decorrelated(np.array([rng.permutation(count) for _ in inputs]).T)
    yield from of((strata + rng.random(strata.shape)) / count)
    while True:
        yield of(rng.random(len(inputs)))


def _decorrelated(strata: NDArray[np.int64]) -> NDArray[np.int64]:
    """Numbers of intervals (N, K), each column in another order, so that the columns hardly correlate."""
    scores = ndtri((strata + 0.5) / len(strata))
    factor = np.linalg.cholesky(np.corrcoef(scores, rowvar=False).reshape(2 * (strata.shape[1],)))
    return np.asarray((scores @ np.linalg.inv(factor).T).argsort(axis=0).argsort(axis=0))
