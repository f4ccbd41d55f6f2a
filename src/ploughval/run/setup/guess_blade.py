"""A guess of the blade: a straight body with two upright edges that travels along the picture.

Edges that stand still are taken off by the median over the photographs; a pair of edges of the first one is
the blade if the same pair, with the same signs, is found ever farther along in those after it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Stack = NDArray[np.float32]

_LEAST_EDGE_GREY = 3.0
_NOISES = 4.0  # standard deviations of an edge by noise
_OF_STRONGEST = 0.12  # an edge weaker than this share of the strongest is none
_MOST_EDGES = 24
_WIDEST = 0.15  # of the picture
_LEAST_WIDTH_PX = 2
_SURE = 0.7
_LEAST = 0.45
_REACH_PX = 4  # of an edge's blur
_BANDS = 4  # parts of the air, from the top, in which edges are looked for


@dataclass(frozen=True, slots=True, eq=False)
class BladeGuess:
    """A body that travels, in pixels of the pictures.

    Attributes
    ----------
    face, back : float
        Columns of its two edges in the first photograph; the face leads.
    travel : (K,) float
        How far the face has gone in each photograph, to the right; NaN where it was not seen.
    score : float
        Share of the edges' strength that is found again, 0 to 1.
    rival : float
        The score of the best body that travels the other way.
    """

    face: float
    back: float
    travel: Floats
    score: float
    rival: float

    @property
    def rightwards(self) -> bool:
        """Whether it travels to the right."""
        return self.face > self.back

    @property
    def sure(self) -> bool:
        """Whether nothing else could be meant."""
        return self.score >= _SURE and self.score - self.rival >= 0.2


def find_blade(images: Stack, air_rows: int) -> BladeGuess | None:
    """Find the blade in the air above the sand.

    Parameters
    ----------
    images : (K, h, w) float32
        Photographs in their order.
    air_rows : int
        Rows above the sand at rest.
    """
    best: dict[bool, BladeGuess] = {}
    for part in range(1, _BANDS + 1):
        rows = max(air_rows * part // _BANDS, 4)
        for guess in _bodies(_edges(images[:, :rows])):
            held = best.get(guess.rightwards)
            if held is None or guess.score > held.score + 0.02:
                best[guess.rightwards] = guess
    if not best:
        return None
    found = max(best.values(), key=lambda g: g.score)
    other = best.get(not found.rightwards)
    rival = 0.0 if other is None else other.score
    if found.score < _LEAST:
        return None
    return BladeGuess(found.face, found.back, found.travel, found.score, rival)


def _edges(band: Stack) -> Floats:
    """Rise of the grey over two columns at upright edges (K, w), without those that stand still."""
    rise = np.zeros(band.shape[::2], np.float64)
    rise[:, 1:-1] = np.median(band[:, :, 2:] - band[:, :, :-2], axis=1)
    return rise - np.median(rise, axis=0)


def _bodies(edges: Floats) -> list[BladeGuess]:
    """Pairs of edges of the first picture that travel together, those that do it best."""
    places = _peaks(edges[0])
    width = edges.shape[1]
    moves = np.arange(-width + 1, width)
    found = []
    for left in places:
        for right in places:
            if not _LEAST_WIDTH_PX <= right - left <= max(_WIDEST * width, 8):
                continue
            if edges[0, left] * edges[0, right] > 0:
                continue
            again = np.minimum(_again(edges, left, moves), _again(edges, right, moves))
            guess = _travelling(edges, (left, right), again, moves)
            if guess is not None:
                found.append(guess)
    return found


def _peaks(edge: Floats) -> list[int]:
    """Columns of the strongest edges."""
    size = np.abs(edge)
    middle = size[1:-1]
    top = (middle >= size[:-2]) & (middle > size[2:])
    least = max(_LEAST_EDGE_GREY, _OF_STRONGEST * float(size.max()), _NOISES * float(np.quantile(size, 0.68)))
    places = np.flatnonzero(top & (middle >= least)) + 1
    return sorted(places[np.argsort(-size[places], kind="stable")][:_MOST_EDGES].tolist())


def _again(edges: Floats, place: int, moves: NDArray[np.intp]) -> Floats:
    """Share (K, M) of an edge's strength that is found after each move."""
    count, width = edges.shape
    padded = np.zeros((count, 3 * width))
    signed = edges * np.sign(edges[0, place])
    near = np.maximum(signed, 0)
    near[:, 1:-1] = np.maximum(np.maximum(near[:, :-2], near[:, 2:]), near[:, 1:-1])
    padded[:, width : 2 * width] = near
    return np.asarray(np.minimum(padded[:, width + place + moves] / abs(edges[0, place]), 1.0))


def _travelling(
    edges: Floats, pair: tuple[int, int], again: Floats, moves: NDArray[np.intp]
) -> BladeGuess | None:
    """The body with these edges, along its best way in one direction."""
    best: BladeGuess | None = None
    for sign in (1, -1):
        ahead = moves * sign >= 0
        share, ways = again[:, ahead][:, ::sign], moves[ahead][::sign]
        steps = _steady_way(share)
        travel = ways[steps]
        scores = share[np.arange(len(share)), steps]
        if np.abs(travel).max() < max(3, 0.5 * (pair[1] - pair[0])):
            continue
        score = float(scores[1:].mean())
        if best is None or score > best.score:
            left, right = (_centre(edges[0], p) for p in pair)
            face, back = (right, left) if sign > 0 else (left, right)
            lead = pair[1] if sign > 0 else pair[0]
            fine = [
                _centre(e * np.sign(edges[0, lead]), lead + int(t), floor=True) - _centre(edges[0], lead)
                if s > 0.3
                else np.nan
                for e, t, s in zip(edges, travel, scores, strict=True)
            ]
            best = BladeGuess(face, back, np.array(fine), score, 0.0)
    return best


def _steady_way(share: Floats) -> NDArray[np.intp]:
    """Of every picture the move (K,) of the best way that never goes back: dynamic programming."""
    count, moves = share.shape
    total = np.full((count, moves), -np.inf)
    total[0, 0] = 0.0
    came = np.zeros((count, moves), np.intp)
    for k in range(1, count):
        before = total[k - 1]
        best = np.maximum.accumulate(before)
        origin = np.maximum.accumulate(np.where(before >= best, np.arange(moves), 0))
        total[k] = share[k] + best
        came[k] = origin
    way = np.zeros(count, np.intp)
    way[-1] = int(np.argmax(total[-1]))
    for k in range(count - 1, 0, -1):
        way[k - 1] = came[k, way[k]]
    return way


def _centre(edge: Floats, place: int, *, floor: bool = False) -> float:
    """Centre of gravity of an edge's strength about a column."""
    low, high = max(place - _REACH_PX, 0), min(place + _REACH_PX + 1, len(edge))
    part = edge[low:high] if floor else edge[low:high] * np.sign(edge[place])
    weight = np.maximum(part, 0.0)
    weight = np.where(weight >= 0.1 * weight.max(initial=0.0), weight, 0.0)
    total = float(weight.sum())
    return float(np.arange(low, high) @ weight) / total if total > 0 else float(place)
