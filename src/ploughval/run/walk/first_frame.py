"""Which photograph shows the sand at rest."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from ploughval.errors import DataError
from ploughval.photos import FrameSeries
from ploughval.run.clock import frame_displacement
from ploughval.scene import Scene

AT_REST_PX = 1.0
"""A blade that has moved by less than this, by the log, counts as at rest."""


def first_frame(
    scene: Scene, frames: FrameSeries, mm_per_px: float, record: Callable[[], pd.DataFrame | None]
) -> int:
    """The first photograph; where it cannot be read, the next one if the log has the blade at rest in it.

    Parameters
    ----------
    scene : Scene
        Gives the clocks' offset.
    frames : FrameSeries
        The photographs.
    mm_per_px : float
        Their scale.
    record : callable
        Gives the load cells' record, with columns time_s and u_mm, or None; asked where the first photograph
        cannot be read.

    Returns
    -------
    int
        Number of the frame.

    Raises
    ------
    DataError
        The first photograph cannot be read, and no log says that the next one shows the same.
    """
    fault = _fault(frames, 0)
    if fault is None:
        return 0
    frame = next((k for k in range(1, len(frames)) if _fault(frames, k) is None), None)
    log = None if frame is None else record()
    if frame is not None and log is not None:
        u_mm = frame_displacement(scene, frames.time_s, np.full(len(frames), np.nan), log).u_mm
        if abs(u_mm[frame]) < AT_REST_PX * mm_per_px:
            return frame
    raise fault


def _fault(frames: FrameSeries, frame: int) -> DataError | None:
    """Why a frame cannot be read; None: it can."""
    try:
        frames.read(frame)
    except DataError as error:
        return error
    return None
