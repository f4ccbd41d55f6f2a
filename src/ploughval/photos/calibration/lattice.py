"""Points of a regular grid told from others: indices grown from neighbour to neighbour, gaps allowed."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Cell = tuple[int, int]

_REACH = 0.25  # of the step: how far a neighbour may lie from where it is expected
_STEPS: tuple[Cell, ...] = ((1, 0), (-1, 0), (0, 1), (0, -1))


def grow_lattice(points: Array) -> tuple[Indices, Indices]:
    """Number the points of the largest regular grid that is found, perspective and lens allowed.

    Parameters
    ----------
    points : (M, 2) float, px
        Candidates, those of the grid and others.

    Returns
    -------
    chosen : (K,) int
        Which of them belong to the grid.
    cell : (K, 2) int
        Their columns and rows, counted from an arbitrary one; columns run to the right, rows down.
    """
    from scipy.spatial import cKDTree

    if len(points) < 4:
        return np.empty(0, np.int64), np.empty((0, 2), np.int64)
    tree = cKDTree(points)
    best: dict[Cell, int] = {}
    for seed in np.argsort(np.hypot(*(points - np.median(points, axis=0)).T))[:12]:
        placed = _grown(points, tree, int(seed))
        best = placed if len(placed) > len(best) else best
        if len(best) > 0.8 * len(points):
            break
    cells = sorted(best, key=lambda cell: (cell[1], cell[0]))
    return np.array([best[c] for c in cells], np.int64), np.array(cells, np.int64).reshape(-1, 2)


def _grown(points: Array, tree: object, seed: int) -> dict[Cell, int]:
    """Cells of the grid reached from a seed, each with its point."""
    basis = _first_basis(points, tree, seed)
    if basis is None:
        return {}
    placed: dict[Cell, int] = {(0, 0): seed}
    taken, queue = {seed}, deque([(0, 0)])
    while queue:
        cell = queue.popleft()
        here = points[placed[cell]]
        for step in _STEPS:
            beside = (cell[0] + step[0], cell[1] + step[1])
            if beside in placed:
                continue
            behind = placed.get((cell[0] - step[0], cell[1] - step[1]))
            move = here - points[behind] if behind is not None else step @ basis
            off, index = tree.query(here + move)  # type: ignore[attr-defined]
            if off < _REACH * np.hypot(*move) and index not in taken:
                placed[beside] = int(index)
                taken.add(int(index))
                queue.append(beside)
    return placed


def _first_basis(points: Array, tree: object, seed: int) -> Array | None:
    """Steps (2, 2) to the right and down from a point to its neighbours; None where they form no grid."""
    _, near = tree.query(points[seed], k=min(5, len(points)))  # type: ignore[attr-defined]
    moves = points[near[1:]] - points[seed]
    right = moves[np.argmax(moves @ [1.0, 0.0] / np.hypot(*moves.T))]
    down = moves[np.argmax(moves @ [0.0, 1.0] / np.hypot(*moves.T))]
    area = right[0] * down[1] - right[1] * down[0]
    lengths = np.hypot(*right), np.hypot(*down)
    square = area > 0.6 * lengths[0] * lengths[1] and max(lengths) < 1.7 * min(lengths)
    return np.stack([right, down]) if square else None
