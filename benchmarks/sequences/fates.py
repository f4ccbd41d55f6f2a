"""What became of the sand under each tracked point, and what its status said."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.scene import load_scene
from ploughval.synth import load_truth
from ploughval.synth.view import frame_view
from sequences.errors import Floats, Tracked

FATES = ("standing", "crossed by a band", "avalanched or swept", "out of picture")
_TORN_PX = 1.0  # two sides of a band have parted by more than this


def confusion(folder: Path, results: Path) -> pd.DataFrame:
    """True fate against the status said, all photographs after the first.

    Returns
    -------
    DataFrame
        One row a fate of FATES, one column a status that occurs; counts of points in photographs.
    """
    scene, truth = load_scene(folder, files=False), load_truth(folder)
    scale = truth.options.mm_per_px
    tracked = Tracked.read(results, truth, scale)
    torn = torn_apart(tracked, truth.positions, scene.piv.subset_px / 4 * scale, _TORN_PX * scale)
    view = frame_view(truth.motion, truth.options)
    place = view.to_px(tracked.true_mm.reshape(-1, 2)).reshape(tracked.true_mm.shape)
    with np.errstate(invalid="ignore"):
        outside = np.any((place < -0.5) | (place > np.array(view.shape[::-1]) - 0.5), axis=-1)
    fate = np.zeros(tracked.status.shape, dtype=int)
    fate[torn] = 1
    fate[~tracked.standing] = 2
    fate[outside] = 3
    said = pd.Series([Status(code).meaning for code in tracked.status[1:].ravel()], name="status")
    true = pd.Series([FATES[k] for k in fate[1:].ravel()], name="true fate")
    return pd.crosstab(true, said).reindex(FATES, fill_value=0)


def torn_apart(
    tracked: Tracked, positions: Callable[[Floats], Floats], reach_mm: float, torn_mm: float
) -> NDArray[np.bool_]:
    """Whether sand ``reach_mm`` from a point along both axes has left it by ``torn_mm``: (F, N) bool."""
    torn = np.zeros(tracked.status.shape, dtype=np.bool_)
    for corner in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        offset = reach_mm * np.array(corner)
        beside = positions(tracked.start_mm + offset)
        apart = np.linalg.norm(beside - tracked.true_mm - offset, axis=-1)
        torn |= ~(apart < torn_mm)
    return torn
