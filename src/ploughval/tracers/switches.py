"""When one band takes over from another, within the increment (docs/theory-bands.md, section 6)."""

from dataclasses import replace

import numpy as np
import pandas as pd

from ploughval.tracers.episodes import Episode
from ploughval.tracers.increment import Motion
from ploughval.tracers.outcrop import height
from ploughval.tracers.view import Floats

_BETWEEN = 0.25  # of the angle between two lines: sand nearer to either may have moved with both
_LEAST_BETWEEN = 4  # points between two lines that place a switch
_LEAST_SHARE_STD = 0.02  # of an increment: better than this a switch is not placed


def start_of(
    motions: list[Motion], table: pd.DataFrame, episodes: list[Episode], number: int
) -> tuple[float, float]:
    """Displacement at which a band began, and its std, mm.

    Sand between the lines of two bands rests until the new one takes over: how far it moves in the last
    increment of the old band and the first of the new is the travel that was left after the switch
    (docs/theory-bands.md, Eq. (21)).
    """
    first = table.loc[episodes[number].rows[0]]
    u0, du = float(first["u_mm"]), float(first["du_mm"])
    if not number:
        return u0, 0.0
    rows = table.loc[[*episodes[number - 1].rows[-1:], episodes[number].rows[0]]]
    found = [
        _moved_between(motions[index], float(row["u_mm"] + row["du_mm"] / 2), episodes, number)
        for index, (_, row) in zip(rows.index.tolist(), rows.iterrows(), strict=True)
    ]
    if not np.isfinite(found).all():
        return u0 + du / 2, du / np.sqrt(12.0)
    left, std = np.sum(found, axis=0)
    least = float(rows["u_mm"].iloc[0])
    return float(np.clip(u0 + du - left, least, u0 + du)), max(float(std), _LEAST_SHARE_STD * du)


def _moved_between(motion: Motion, tip: float, episodes: list[Episode], number: int) -> tuple[float, float]:
    """Median horizontal motion of sand between a band's line and the one before, and its std, mm."""
    angle = np.arctan2(motion.place[:, 1], motion.place[:, 0])
    old, new = (np.arctan2(e.outcrop_y_mm, e.outcrop_x_mm - tip) for e in episodes[number - 1 : number + 1])
    margin = _BETWEEN * (old - new)
    moved = motion.rate[(angle > new + margin) & (angle < old - margin), 0] * motion.travel_mm
    if len(moved) < _LEAST_BETWEEN:
        return np.nan, np.nan
    middle = float(np.median(moved))
    return middle, 1.4826 * float(np.median(np.abs(moved - middle))) / np.sqrt(len(moved))


def as_it_began(episode: Episode, line: Floats) -> Episode:
    """The band with the height of its outcrop in the last photograph, (M, 3), before it moved anything."""
    y, std = height(line, episode.outcrop_x_mm)
    if not np.isfinite(y):
        return episode
    return replace(episode, outcrop_y_mm=y, outcrop_y_std_mm=std)
