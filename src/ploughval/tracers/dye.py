"""Dyed layers found in the picture: runs of dyed pixels, linked to chains, named by where they were."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.spatial import cKDTree

from ploughval.changing import Changing
from ploughval.scene import Tracers
from ploughval.tracers.appearance import Appearance
from ploughval.tracers.dye_kernel import MOST_RUNS, Ints, chains, dyed_runs, names
from ploughval.tracers.dye_memory import Memory, Motion
from ploughval.tracers.light import Lighting
from ploughval.tracers.view import Cut, Floats, Image, Mask, View

_SAMPLES = 4  # columns read in a length of one thickness
_ALONG_PX = 3.0  # std of the smoothing along a layer, at least
_THINNEST, _THICKEST = 0.3, 2.4  # of the thickness at rest
_MOST_GAP = 2  # samples that a chain may leap
_STEEPEST = 1.5
_NOT_IT = 1.5  # thicknesses from where a layer is expected: what lies further off is not that layer
_RENAME = 3.0  # price of a change of name along a chain, in thicknesses
_OTHER_GREY = 0.5  # of the contrast between two dyes, that counts as much as one thickness
_CARRIED = 0.4  # thickness from points that tracking has carried, that counts as much as one
_SMOOTH, _LEAST_MEDIAN = 2.0, 7  # thicknesses, points: length of the running median along a layer
_USUAL_WIDTH = 0.25  # a run that is wider or narrower than its neighbours by more holds a stray grain
_LIKE = 1.6  # dyes whose contrasts with the sand differ by less are searched together
_LEAST_CONTRAST = 0.08  # of the sand's grey
_DEFAULT_THICKNESS_MM = 2.0
_GRAIN_PX = 0.35  # by which grains shift the edges of a layer, over stretches longer than the smoothing
_STRIP = 1.5  # depths of a layer's thickness: the strip before the face in which the block's rise is read
_LEAST_MATCH = 0.5


@dataclass(frozen=True, slots=True)
class Dye:
    """Grey of a dyed layer and of the sand beside it, at rest; NaN where they do not differ."""

    dyed: float
    plain: float

    @property
    def contrast(self) -> float:
        """Dyed sand against plain sand, grey levels, with its sign."""
        return self.dyed - self.plain


@dataclass(frozen=True, slots=True, eq=False)
class _Picture:
    """One frame as the search for layers takes it: sampled columns, from row ``first`` on.

    ``upper``: first row of sand in each column; ``covered``: columns in which the sand is hidden; ``motion``
    since the frame before; ``carried``: points that tracking carried, by layer.
    """

    grey: Image
    first: int
    upper: Ints
    covered: Mask
    motion: Motion
    carried: dict[float, Floats]


@dataclass(frozen=True, slots=True, eq=False)
class _Runs:
    """Runs of dyed pixels, (N,) each: sample, row of the middle, thickness in rows, mean grey."""

    column: Ints
    middle: Floats
    width: Floats
    grey: Floats


class DyeFollower(Changing):
    """Follows the dyed layers of a test from photograph to photograph.

    The dye may be darker or paler than the sand: the sign is read in the first photograph.

    Parameters
    ----------
    view : grid of the photographs
    tracers : heights and thickness of the dyed layers
    image : (h, w) uint8 or uint16, the first frame on the grid
    look : what the sand looks like at rest
    rest : (w,) rows of each layer in the first frame, by its height; None: level
    """

    CHANGES = ("_face", "_memory", "_strip", "_slope")

    def __init__(
        self,
        view: View,
        tracers: Tracers,
        image: Cut,
        look: Appearance,
        rest: dict[float, Floats] | None = None,
    ) -> None:
        self._view, self._look = view, look
        self._thickness = (tracers.thickness_mm or _DEFAULT_THICKNESS_MM) / view.step_mm
        self._step = int(np.clip(round(self._thickness / _SAMPLES), 2, 8))
        self._median = max(2 * round(_SMOOTH * self._thickness / self._step / 2) + 1, _LEAST_MEDIAN)
        count = view.shape[1] // self._step
        self._place: Floats = np.arange(0.0, count) * self._step + (self._step - 1) / 2
        self._face = float(view.column(0.0))
        level = np.ones(view.shape[1])
        rows = rest or {h: view.row(h) * level for h in tracers.dyed_layers_mm}
        thin = {h: np.interp(self._place, np.arange(view.shape[1]), r) for h, r in rows.items()}
        self._memory = {h: Memory(r, self._thickness, self._step) for h, r in thin.items()}
        grey = self._reduced(image, Lighting(image.shape), (0, image.shape[0]))[0]
        self._dyes = {h: self._learn(grey, thin, h) for h in rows}
        self._groups = _groups(self._dyes)
        self._strip: Floats | None = None
        self._slope = np.nan  # of the block's motion, as it was last seen

    def stands_out(self, height: float) -> bool:
        """Whether a layer could be told from the sand beside it at rest."""
        return bool(np.isfinite(self._dyes[height].dyed))

    def follow(
        self,
        image: Cut,
        lighting: Lighting,
        top: Floats,
        face: float,
        *,
        hidden: Floats | None = None,
        carried: dict[float, Floats] | None = None,
    ) -> dict[float, Floats]:
        """The dyed layers of the next frame.

        Parameters
        ----------
        image : (h, w) uint8 or uint16
            Frame on the grid.
        lighting : Lighting
            Its light against the first frame's.
        top : (w,) float
            Row of the free surface in each column.
        face : float
            Column of the blade's face.
        hidden : (K, 2) float or None
            First and last columns of stretches in which the sand is hidden.
        carried : dict of layer height, mm -> (K, 2) float, or None
            Columns and rows of tracked points of each layer in this frame.

        Returns
        -------
        dict of layer height, mm -> (K, 3) float: x, y, std, mm; rows of NaN at gaps
        """
        travel, self._face = face - self._face, face
        told = {} if carried is None else {h: p[np.isfinite(p).all(axis=1)] for h, p in carried.items()}
        grey, first = self._reduced(image, lighting, self._window(Motion(travel, np.nan), top, told))
        upper = np.ceil(np.interp(self._place, np.arange(len(top)), top) - first + 1e-9).astype(np.int64)
        upper[self._place < face + 2] = len(grey)
        covered = _inside(self._place, hidden)
        up = self._rise(grey, np.where(covered, len(grey), upper), first, travel)
        if np.isfinite(up) and travel >= 1:
            self._slope = up / travel
        motion = Motion(travel, up if np.isfinite(up) else self._slope * travel)
        picture = _Picture(grey, first, upper, covered, motion, told)
        out = dict.fromkeys(self._dyes, np.full((1, 3), np.nan))
        for group in self._groups:
            out |= self._follow_group(group, picture)
        return out

    def _window(self, motion: Motion, top: Floats, carried: dict[float, Floats]) -> tuple[int, int]:
        """Rows in which any layer may stand ahead of the face."""
        ahead = self._place > self._face
        if not ahead.any():
            ahead[-1] = True
        low, high = [], []
        for height, memory in self._memory.items():
            lowest, highest = (v[ahead] for v in memory.reach(motion))
            rows = carried.get(height, np.empty((0, 2)))[:, 1]
            low.append(np.nanmin([*lowest, *rows]) if np.isfinite(lowest).any() else np.nan)
            high.append(np.nanmax([*highest, *rows]) if np.isfinite(highest).any() else np.nan)
        margin = 3 * self._thickness + 8
        last = self._view.shape[0]
        first = int(np.clip(np.nanmin([*low, last - 16.0]) - margin, 0, last - 16))
        return max(first, int(np.clip(np.min(top) - margin, 0, last - 16))), int(
            np.clip(np.nanmax([*high, 16.0]) + margin, first + 16, last)
        )

    def _reduced(self, image: Cut, lighting: Lighting, rows: tuple[int, int]) -> tuple[Image, int]:
        """Sampled columns of some rows, evened and smoothed, (rows, K) float32, and the first row."""
        first, last = rows
        count = len(self._place)
        part: NDArray[Any] = np.ascontiguousarray(image[first:last, : count * self._step])
        grey = np.asarray(
            cv2.resize(part, (count, last - first), interpolation=cv2.INTER_AREA), dtype=np.float32
        )
        factor = 1 / self._look.light[: count * self._step].reshape(count, -1).mean(axis=1)
        if not lighting.same:
            factor *= lighting.columns(0, image.shape[1])[np.rint(self._place).astype(int)]
            grey *= lighting.rows(first, last).astype(np.float32)[:, None]
        grey *= factor.astype(np.float32)
        along = max(_ALONG_PX, self._thickness / 5) / self._step
        across = max(self._thickness / 8, 0.7)
        return np.asarray(cv2.GaussianBlur(grey, (0, 0), sigmaX=along, sigmaY=across), np.float32), first

    def _learn(self, grey: Image, rows: dict[float, Floats], height: float) -> Dye:
        """Grey of the dyed layer and of the sand beside it, in the first frame."""
        row = np.arange(len(grey))[:, None]
        band = self._thickness
        top = np.interp(self._place, np.arange(len(self._look.top)), self._look.top)
        sand = (row > top + 2) & (self._place > self._face + 2)
        off = np.abs(row - rows[height])
        beside = sand & (off > 0.5 * band + 2) & (off < 1.2 * band + 3)
        for other in rows:
            if other != height:
                beside &= np.abs(row - rows[other]) > 0.5 * band + 2
        inside = sand & (off < 0.3 * band)
        if not inside.any() or not beside.any():
            return Dye(np.nan, np.nan)
        dye = Dye(float(np.median(grey[inside])), float(np.median(grey[beside])))
        return dye if abs(dye.contrast) > _LEAST_CONTRAST * dye.plain else Dye(np.nan, np.nan)

    def _rise(self, grey: Image, upper: Ints, first: int, travel: float) -> float:
        """Rows that the sand before the face has risen since the last frame; NaN where that is not clear."""
        near = (self._place > self._face + 3) & (self._place < self._face + 3 + 3 * self._thickness + 16)
        strip = np.full(self._view.shape[0], np.nan)
        if near.any() and np.max(upper[near]) < len(grey):
            start = max(int(np.max(upper[near])) + 2, 0)
            strip[first + start : first + len(grey)] = grey[start:, near].mean(axis=1)
        before, self._strip = self._strip, strip
        if before is None or travel < 1:
            return 0.0 if abs(travel) < 1 else np.nan
        best, up = _LEAST_MATCH, np.nan
        for shift in range(int(np.ceil(1.5 * travel)) + 4):
            a, b = strip[: len(strip) - shift], before[shift:]
            both = np.isfinite(a) & np.isfinite(b)
            if both.sum() < 4 * self._thickness:
                continue
            a, b = a[both] - a[both].mean(), b[both] - b[both].mean()
            match = float(a @ b) / max(float(np.sqrt((a @ a) * (b @ b))), 1e-9)
            if match > best:
                best, up = match, float(shift)
        return up

    def _follow_group(self, group: tuple[float, ...], picture: _Picture) -> dict[float, Floats]:
        """Layers of like dyes: their runs, linked to chains, each chain by its cheapest names."""
        runs = self._runs(group, picture)
        cost = np.column_stack([self._cost(h, runs, picture, len(group) > 1) for h in group])
        thick = runs.width / self._thickness
        fit = (thick > _THINNEST) & (thick < _THICKEST) & (cost.min(axis=1) < _NOT_IT)
        column, middle, width, cost = runs.column[fit], runs.middle[fit], runs.width[fit], cost[fit]
        limit = np.array([_STEEPEST * self._step + 1.0, 0.7 * self._thickness])
        chain = chains(column, middle, width, limit, _MOST_GAP)
        order = np.lexsort((column, chain))
        column, cost, chain = column[order], cost[order], chain[order]
        middle = _without_grains(middle[order], width[order], chain, 2 * self._median + 1)
        cost = np.column_stack([cost, np.full(len(cost), _NOT_IT)])
        name = names(cost, chain, _RENAME)
        pieces = _pieces(chain, name, cost, round(_STEEPEST * self._thickness / self._step) + 2)
        found = {}
        for index, height in enumerate(group):
            own = _without_doubles([p for p in pieces if name[p[0]] == index], column, cost[:, index])
            places = np.concatenate(own) if own else np.empty(0, np.int64)
            places = places[np.argsort(column[places], kind="stable")]
            self._memory[height].keep(column[places], middle[places], picture.covered, picture.motion)
            found[height] = self._in_world([(column[p], middle[p]) for p in own])
        return found

    def _runs(self, group: tuple[float, ...], picture: _Picture) -> _Runs:
        """Runs of dyed pixels in every sampled column (docs/theory-geometry.md, Eq. (6))."""
        dyed = float(np.mean([self._dyes[h].dyed for h in group]))
        plain = float(np.mean([self._dyes[h].plain for h in group]))
        share = np.clip((picture.grey - np.float32(plain)) / np.float32(dyed - plain), -0.5, 1.2)
        runs = np.empty((len(self._place), MOST_RUNS, 3))
        count = dyed_runs(share, picture.upper, np.full(len(self._place), len(share)), runs)
        inside = np.arange(MOST_RUNS) < count[:, None]
        high, low, mean = runs[inside].T
        middle = (high + low) / 2 + picture.first
        return _Runs(np.nonzero(inside)[0], middle, low - high, plain + mean * (dyed - plain))

    def _cost(self, height: float, runs: _Runs, picture: _Picture, several: bool) -> Floats:
        """How unlikely runs belong to a layer, in thicknesses (docs/theory-geometry.md, Eq. (7))."""
        cost = self._memory[height].distance(runs.column.astype(float), runs.middle, picture.motion)
        points, place = picture.carried.get(height, np.empty((0, 2))), self._place[runs.column]
        if len(points):
            spacing = float(np.median(np.diff(np.sort(points[:, 0])))) if len(points) > 1 else 0.0
            apart = cKDTree(points).query(np.column_stack([place, runs.middle]))[0]
            told = np.maximum(apart - spacing / 2 - 1.5, 0.0) / (_CARRIED * self._thickness)
            beside = cKDTree(points[:, :1]).query(place[:, None])[0]
            cost = np.where(beside < 1.5 * spacing + 2, told, cost)
        if several:
            dye = self._dyes[height]
            other = np.abs(runs.grey - dye.dyed) / abs(_OTHER_GREY * dye.contrast)
            cost = cost + np.maximum(other - 0.6, 0.0)
        return cost

    def _in_world(self, pieces: list[tuple[Ints, Floats]]) -> Floats:
        """Pieces of a layer as (K, 3) x, y, std, mm, in order of their beginnings, NaN between them."""
        rows: list[Floats] = []
        gap = np.full((1, 3), np.nan)
        for column, row in sorted(pieces, key=lambda piece: int(piece[0][0])):
            smooth = median_filter(row, self._median, mode="nearest")
            scatter = 1.4826 * float(np.median(np.abs(row - smooth)))
            std = np.full(len(row), float(np.hypot(scatter, _GRAIN_PX)) * self._view.step_mm)
            x, y = self._view.x_mm(self._place[column]), self._view.y_mm(smooth)
            rows += [np.column_stack([x, y, std]), gap]
        return np.concatenate(rows[:-1]) if rows else gap


def _groups(dyes: dict[float, Dye]) -> list[tuple[float, ...]]:
    """Layers whose dyes stand out alike from the sand."""
    groups: list[list[float]] = []
    for height in sorted(h for h in dyes if np.isfinite(dyes[h].dyed)):
        for group in groups:
            ratio = dyes[height].contrast / dyes[group[0]].contrast
            if 1 / _LIKE < ratio < _LIKE:
                group.append(height)
                break
        else:
            groups.append([height])
    return [tuple(g) for g in groups]


def _inside(place: Floats, stretches: Floats | None) -> Mask:
    """Which places lie in any of the stretches (K, 2)."""
    inside = np.zeros(len(place), bool)
    for first, last in () if stretches is None else stretches:
        inside |= (place >= first) & (place <= last)
    return inside


def _pieces(chain: Ints, name: Ints, cost: Floats, least: int) -> list[Ints]:
    """Indices of successive runs of one chain and one name, of at least so many; without nameless ones."""
    if len(chain) == 0:
        return []
    cuts = np.flatnonzero((np.diff(chain) != 0) | (np.diff(name) != 0)) + 1
    parts = np.split(np.arange(len(chain)), cuts)
    return [p for p in parts if len(p) >= least and name[p[0]] < cost.shape[1] - 1]


def _without_grains(middle: Floats, width: Floats, chain: Ints, size: int) -> Floats:
    """Middles of runs; where a run is not as wide as its neighbours, those on the line between them."""
    middle = middle.copy()
    for part in np.split(np.arange(len(chain)), np.flatnonzero(np.diff(chain)) + 1):
        usual = median_filter(width[part], size, mode="nearest")
        plain = np.abs(width[part] - usual) < _USUAL_WIDTH * usual
        if plain.any():
            middle[part] = np.interp(part, part[plain], middle[part[plain]])
    return middle


def _without_doubles(pieces: list[Ints], column: Ints, cost: Floats) -> list[Ints]:
    """Pieces of one layer; of two above each other the worse one only where it fits well too."""
    pieces = sorted(pieces, key=lambda p: float(cost[p].mean()))
    kept: list[Ints] = []
    taken: set[int] = set()
    for piece in pieces:
        covered = np.mean([k in taken for k in column[piece].tolist()])
        if covered > 0.3 and float(cost[piece].mean()) > 0.4:
            continue
        kept.append(piece)
        taken.update(column[piece].tolist())
    return kept
