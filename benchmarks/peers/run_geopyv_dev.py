"""Measures with geopyv-dev: its subsets at the points of the grid, each started from a solved neighbour.

Its mesh is not used, as it rejects all of its nodes when a single triangle turns over.
"""

import heapq

import geopyv_dev
import numpy as np
from adaptor import MARGIN, STEP, SUBSET, Found, Picture, grid, serve
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

Floats = NDArray[np.float64]


def blurred(picture: Picture) -> Floats:
    """Gaussian blur that the package does when it reads a file: 5 x 5 px, 1.1 px."""
    return np.asarray(gaussian_filter(picture.astype(np.float64), 1.1, radius=2, mode="mirror"))


def whole_shift(reference: Floats, current: Floats, x: int, y: int, half: int = 128) -> list[float]:
    """Whole-pixel displacement by phase correlation about a point: the start that a user has to give."""
    window = np.s_[y - half : y + half, x - half : x + half]
    first, second = (
        np.fft.rfft2(picture[window] - picture[window].mean()) for picture in (reference, current)
    )
    cross = second * np.conj(first)
    peaks = np.fft.irfft2(cross / np.maximum(np.abs(cross), 1e-9))
    row, column = np.unravel_index(int(np.argmax(peaks)), peaks.shape)
    return [float((place + half) % (2 * half) - half) for place in (column, row)]


def measure(reference: Picture, current: Picture) -> Found:
    """Square subsets of first order; the best solved one goes on to its neighbours."""
    pictures = [blurred(picture) for picture in (reference, current)]
    images = [geopyv_dev.Image(image_gs=picture) for picture in pictures]
    square = geopyv_dev.Mask("local", shape="square", size=SUBSET // 2)
    points = grid(reference.shape)
    columns = len(np.arange(MARGIN, reference.shape[1] - MARGIN, STEP))
    moved, valid = np.full(points.shape, np.nan), np.zeros(len(points), dtype=np.bool_)
    seed = len(points) // columns // 2 * columns + columns // 2
    start = [*whole_shift(*pictures, *points[seed].astype(int)), 0.0, 0.0, 0.0, 0.0]
    waiting, seen = [(0.0, seed, start)], {seed}
    while waiting:
        _, index, start = heapq.heappop(waiting)
        subset = geopyv_dev.Subset(points[index].tolist(), square, *images, subset_order=1)
        subset.solve(p_0=start)
        warp = start
        if subset.p is not None:
            warp = list(subset.p)
            moved[index], valid[index] = warp[:2], bool(subset.solved)
        row, column = divmod(index, columns)
        for r, c in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
            other = r * columns + c
            if 0 <= c < columns and 0 <= other < len(points) and other not in seen:
                seen.add(other)
                guess = shifted(warp if valid[index] else start, points[other] - points[index])
                heapq.heappush(waiting, (-(subset.c_zncc or 0.0), other, guess))
    return Found(points, moved, valid)


def shifted(warp: list[float], offset: Floats) -> list[float]:
    """Affine warp (u, v, du/dx, dv/dx, du/dy, dv/dy) as it is at another point."""
    u, v, u_x, v_x, u_y, v_y = warp
    return [u + u_x * offset[0] + u_y * offset[1], v + v_x * offset[0] + v_y * offset[1], u_x, v_x, u_y, v_y]


if __name__ == "__main__":
    raise SystemExit(serve("geopyv-dev", measure))
