"""Light of a photograph against that of the first one: its level and its slow change over the picture."""

from dataclasses import dataclass

import numpy as np

from ploughval.tracers.view import Cut, Floats, Image

_BLOCKS = 48  # along the longer side
_SAMPLES = 8  # pixels along a block's side that are read
_ROUNDS = 25
_TUKEY = 4.685  # of the biweight, Huber and Ronchetti (2009)
_SCATTER_FLOOR = 0.003  # of the logarithm: finer differences of two pictures are noise
_NEGLIGIBLE = 0.002  # of the light: such a change is not worth a multiplication
_MOST_SCATTER = 0.12
_LEAST_SHARE = 0.3  # of the blocks must agree
_DARKEST = 0.02  # of the brightest block: darker ones say nothing of a ratio


@dataclass(frozen=True, slots=True)
class Lighting:
    """Logarithm of the light relative to the first photograph: level + across x + down y.

    x and y run from -1 to 1 over the grid. ``agrees``: whether the pictures could be compared.
    """

    shape: tuple[int, int]
    level: float = 0.0
    across: float = 0.0
    down: float = 0.0
    agrees: bool = True

    @property
    def same(self) -> bool:
        """Whether the light is that of the first photograph."""
        return abs(self.level) + abs(self.across) + abs(self.down) < _NEGLIGIBLE

    def columns(self, first: int, last: int) -> Floats:
        """Factor that takes the change off columns first to last - 1, with that of the level."""
        place = 2 * np.arange(first, last) / max(self.shape[1] - 1, 1) - 1
        return np.asarray(np.exp(-self.level - self.across * place))

    def rows(self, first: int, last: int) -> Floats:
        """Factor that takes the change off rows first to last - 1."""
        place = 2 * np.arange(first, last) / max(self.shape[0] - 1, 1) - 1
        return np.asarray(np.exp(-self.down * place))

    def even(self, part: Image, first_row: int, first_column: int) -> None:
        """Take the change of the light off a part of the picture, in place."""
        if self.same:
            return
        height, width = part.shape
        part *= self.columns(first_column, first_column + width).astype(np.float32)
        part *= self.rows(first_row, first_row + height).astype(np.float32)[:, None]


class LightMeter:
    """Compares photographs with the first one, block by block.

    Most blocks show the same sand or the same air as before; those where something moved, or a hand is
    in the picture, do not fit a level and two slopes (docs/theory-geometry.md, Eq. (1)) and lose their say
    (iteratively reweighted least squares with Tukey's biweight, started from the shortest half, Rousseeuw
    1984).

    Parameters
    ----------
    image : (h, w) uint8 or uint16
        The first frame on the grid.
    """

    def __init__(self, image: Cut) -> None:
        side = max(max(image.shape) // _BLOCKS, _SAMPLES)
        self._stride = max(side // _SAMPLES, 1)
        self._shape = image.shape
        self._full = float(np.iinfo(image.dtype).max)
        self._rest = self._means(image)
        rows, columns = self._rest.shape
        x = (np.arange(columns) + 0.5) * _SAMPLES * self._stride / self._shape[1] * 2 - 1
        y = (np.arange(rows) + 0.5) * _SAMPLES * self._stride / self._shape[0] * 2 - 1
        across, down = np.meshgrid(x, y)
        self._terms = np.stack([np.ones_like(across), across, down], axis=-1)

    def compare(self, image: Cut) -> Lighting:
        """Light of another frame, relative to the first."""
        mean = self._means(image)
        usable = (self._rest > _DARKEST * self._rest.max()) & (mean > 0) & (mean < 0.98 * self._full)
        if usable.sum() < 12:
            return Lighting(self._shape, agrees=False)
        change = np.log(mean[usable] / self._rest[usable])
        terms, weight = self._terms[usable], np.sqrt(self._rest[usable])
        fit = np.array([densest_half(change)[0], 0.0, 0.0])
        for _ in range(_ROUNDS):
            off = np.abs(change - terms @ fit)
            scatter = max(densest_half(change - terms @ fit)[1], _SCATTER_FLOOR)
            say = weight * np.maximum(1 - (off / (_TUKEY * scatter)) ** 2, 0.0) ** 2
            fit = np.linalg.lstsq(terms * np.sqrt(say)[:, None], change * np.sqrt(say), rcond=None)[0]
        if scatter > _MOST_SCATTER or np.mean(off < 3 * scatter) < _LEAST_SHARE:
            return Lighting(self._shape, agrees=False)
        level, across, down = (float(v) for v in fit)
        return Lighting(self._shape, level, across, down)

    def _means(self, image: Cut) -> Floats:
        thin = np.ascontiguousarray(image[:: self._stride, :: self._stride], dtype=np.float32)
        rows, columns = (max(n // _SAMPLES, 1) for n in thin.shape)
        thin = thin[: rows * _SAMPLES, : columns * _SAMPLES]
        return np.asarray(
            thin.reshape(rows, thin.shape[0] // rows, columns, thin.shape[1] // columns).mean(axis=(1, 3)),
            float,
        )


def densest_half(value: Floats) -> tuple[float, float]:
    """Median and robust std of the shortest interval that holds half of the values (Rousseeuw 1984)."""
    ordered = np.sort(value)
    half = len(ordered) // 2 + 1
    lengths = ordered[half - 1 :] - ordered[: len(ordered) - half + 1]
    first = int(np.argmin(lengths))
    return float(np.median(ordered[first : first + half])), float(lengths[first]) / 1.349
