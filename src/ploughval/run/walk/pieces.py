"""Pieces of the walk through the photographs: what some of them showed, and where the walk stood then."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.photos.markers.fit import RimFit
from ploughval.piv import CameraMovement
from ploughval.piv.interpolate import SlopeFilter
from ploughval.piv.precision import Noise
from ploughval.piv.steady import SandSeen
from ploughval.run.kept.snapshots import from_arrays, to_arrays
from ploughval.run.walk.frame_notes import Noted, texts_of
from ploughval.run.walk.noise import NO_NOISE
from ploughval.run.walk.pattern import NO_TEXTURE
from ploughval.run.walk.window import WindowRecord
from ploughval.tracers.surface import Usual

Floats = NDArray[np.float64]

NO_POINTS: dict[str, Floats] = {"points_px": np.empty((0, 2)), "layer_mm": np.empty(0)}
"""Arrays of a walk in which no points are tracked."""


@dataclass(frozen=True, slots=True)
class Rows:
    """What n photographs showed, in the words of :class:`ploughval.run.walk.window.WindowRecord`.

    Of the n photographs the last m are from the first readable one on, and have N tracked points.
    """

    blade: Floats  # (n, 2)
    camera: Floats  # (n, 3)
    surface: Floats  # (K, 4)
    dyed: Floats  # (K, 5)
    position_px: Floats  # (m, N, 2)
    point_std_px: Floats  # (m, N)
    zncc: Floats  # (m, N)
    status: NDArray[np.int8]  # (m, N)
    lost: dict[int, str]
    unseen: dict[int, list[str]]
    noted: tuple[Noted, ...]
    once: dict[str, Floats]  # what the whole series has once: points, noise, texture


@dataclass(frozen=True, slots=True)
class Piece:
    """The walk over frames ``first`` to ``last`` - 1.

    Attributes
    ----------
    first, last : int
    rows : Rows
        What these photographs showed.
    state : dict
        Where the walk stands after them; empty where nothing goes on from this piece.
    """

    first: int
    last: int
    rows: Rows
    state: dict[str, Any] = field(default_factory=dict)

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        """The piece as named arrays."""
        return to_arrays(self)

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> "Piece":
        """The piece from :meth:`to_arrays`.

        Raises
        ------
        ValueError
            When the arrays are not those of a piece.
        """
        piece = from_arrays(arrays, (cls, *_STORED))
        if not isinstance(piece, cls):
            raise ValueError("not a piece of a walk")
        return piece

    def without_state(self) -> "Piece":
        """The piece when another one follows."""
        return replace(self, state={})


_STORED = (Rows, Noted, CameraMovement, SandSeen, RimFit, Noise, SlopeFilter, Usual)


def state_of(arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """The state of a walk from the arrays that it was kept as.

    Raises
    ------
    ValueError
        When the arrays are not those of a state.
    """
    state = from_arrays(arrays, _STORED)
    if not isinstance(state, dict) or type(state.get("frame")) is not int or state["frame"] < 1:
        raise ValueError("not the state of a walk")
    return state


def merged(pieces: Sequence[Piece]) -> Piece:
    """Pieces that follow each other as one, with the state of the last.

    Raises
    ------
    ValueError
        When one does not begin where the one before it ends.
    """
    for before, after in pairwise(pieces):
        if after.first != before.last:
            raise ValueError(f"a piece begins at frame {after.first}; expected {before.last}")
    rows = [piece.rows for piece in pieces]
    started = [one for one in rows if len(one.status)] or rows[:1]  # before, the count of points is not known
    parts: dict[str, Any] = {
        f.name: np.concatenate([getattr(one, f.name) for one in (started if f.name in _OF_POINTS else rows)])
        for f in fields(Rows)
        if f.name not in _OTHERS
    }
    for name in ("lost", "unseen", "once"):
        parts[name] = {key: value for one in rows for key, value in getattr(one, name).items()}
    noted = tuple(noted for one in rows for noted in one.noted)
    return Piece(pieces[0].first, pieces[-1].last, Rows(**parts, noted=noted), pieces[-1].state)


_OF_POINTS = ("position_px", "point_std_px", "zncc", "status")
_OTHERS = ("lost", "unseen", "noted", "once")


def join(pieces: Sequence[Piece]) -> WindowRecord:
    """The record of a walk from all of its pieces, from frame 0 to the last one."""
    rows = merged(pieces).rows
    once = {**NO_POINTS, **NO_NOISE, **NO_TEXTURE, **rows.once}
    count = len(once["points_px"])
    before = len(rows.blade) - len(rows.status)  # frames before the first one that could be read

    def whole(values: NDArray[Any], missing: float) -> NDArray[Any]:
        if not before:
            return values
        nothing = np.full((before, count, *values.shape[2:]), missing, values.dtype)
        return np.concatenate([nothing, values]) if len(values) else nothing

    return WindowRecord(
        blade=rows.blade,
        surface=rows.surface,
        dyed=rows.dyed,
        position_px=whole(rows.position_px, np.nan),
        point_std_px=whole(rows.point_std_px, np.nan),
        zncc=whole(rows.zncc, np.nan),
        status=whole(rows.status, Status.FRAME_MISSING),
        camera=rows.camera,
        lost_frames=rows.lost,
        notes=texts_of(rows.noted),
        unseen=rows.unseen,
        **once,
    )
