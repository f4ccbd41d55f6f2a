"""The sand of one test as grains that move, avalanche and are photographed."""

from dataclasses import dataclass, field

import numpy as np

from ploughval.synth.motion import Bools, Floats, Motion, pour
from ploughval.synth.options import SynthOptions
from ploughval.synth.sand import Canvas, sand_texture
from ploughval.synth.view import View

_DYED_LAYER = 0.4
"""Grey of a grain in a dyed layer, relative to its natural grey."""

_RIM_PX = 12.0

_TIP_LEVEL_MM = 1e-6
"""Slack of the level below which sand rests: more than the rounding of a step."""


@dataclass(slots=True)
class SandBed:
    """Grains of one test, moved in place.

    Attributes
    ----------
    positions_mm : (N, 2) float64, mm
    radii_px, areas_px, greys : (N,) float64, as in :class:`ploughval.synth.Grains`
    avalanched : (N,) bool, grains that were turned over at least once
    steps_done : int
    poured : list of two int
        Grains put down so far, ahead of the blade and behind it.
    """

    positions_mm: Floats
    radii_px: Floats
    areas_px: Floats
    greys: Floats
    avalanched: Bools
    steps_done: int = 0
    poured: list[int] = field(default_factory=lambda: [0, 0])

    def advance(self, motion: Motion, steps: int, rng: np.random.Generator) -> None:
        """Go on to ``steps`` steps done; grains that avalanche are put where the surface rose."""
        for k in range(self.steps_done, steps):
            # below the tip's level nothing is pushed and nothing avalanches
            within = np.flatnonzero(self.positions_mm[:, 1] > -_TIP_LEVEL_MM)
            moved = self.positions_mm[within]
            gone = within[motion.step(k, moved)]
            self.positions_mm[within] = moved
            if not len(gone):
                continue
            face = motion.u_mm[k] + motion.du_mm[k]
            ahead = self.positions_mm[gone, 0] >= face
            for side, (which, risen) in enumerate(
                ((ahead, motion.risen_ahead), (~ahead, motion.risen_behind))
            ):
                turned = rng.permutation(gone[which])
                if len(turned):
                    places = _evenly(rng, self.poured[side], len(turned))
                    self.positions_mm[turned] = pour(places, *risen(k))
                    self.poured[side] += len(turned)
            self.avalanched[gone] = True
        self.steps_done = max(self.steps_done, steps)

    def canvas(self, shape: tuple[int, int], air_grey: float) -> Canvas:
        """Draws the grains as what they add to air of one grey level."""
        return Canvas(self.radii_px, self.areas_px * (self.greys - air_grey), shape)


def _evenly(rng: np.random.Generator, first: int, count: int) -> Floats:
    """Points ``first`` and following of a sequence that fills the unit square evenly (Roberts 2018, R2).

    Fresh sand is laid in slivers thinner than a grain; independent numbers would leave it clotted, and
    the sequence by itself in rows: it is shaken by a third of the square.
    """
    golden = 1.32471795724474602596
    places: Floats = np.arange(first, first + count)[:, None] * np.array([1 / golden, 1 / golden**2])
    places += 0.3 * rng.random(places.shape)
    return places % 1.0


def fill_bed(rng: np.random.Generator, view: View, motion: Motion, options: SynthOptions) -> SandBed:
    """Grains below the first surface, outside the blade, as far as they can come into the picture."""
    trench = motion.trench
    reach_px = -trench.scar_x_mm / view.mm_per_px + _RIM_PX
    grains = sand_texture(
        rng,
        view.shape,
        margin_px=max(reach_px - view.tip_px[0], _RIM_PX),
        spacing_px=options.spacing_px,
        diameter_px=options.diameter_px,
        grey=options.grain_grey,
    )
    x, y = view.to_mm(grains.positions_px).T
    ahead = motion.surfaces[0]
    sand = np.where(x >= 0, y < np.interp(x, *ahead.T), (y < options.depth_mm) & (x < -options.thickness_mm))
    sand |= (y < 0) & (x < 0)
    height, width = view.shape
    sand &= (grains.positions_px[:, 0] < width + _RIM_PX) & (grains.positions_px[:, 1] < height + _RIM_PX)
    greys = grains.greys.copy()
    if options.dyed:
        for layer in options.layers_mm:
            greys[np.abs(y - layer) <= options.layer_thickness_mm / 2] *= _DYED_LAYER
    return SandBed(
        np.column_stack([x, y])[sand],
        grains.radii_px[sand],
        grains.areas_px[sand],
        greys[sand],
        np.zeros(int(sand.sum()), dtype=np.bool_),
    )
