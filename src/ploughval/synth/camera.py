"""The photographs of a synthetic test, one at a time."""

from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Direction
from ploughval.synth.bed import fill_bed
from ploughval.synth.motion import Motion
from ploughval.synth.options import Purpose, SynthOptions
from ploughval.synth.view import View, expose, light_field

Levels = NDArray[np.uint8] | NDArray[np.uint16]


def photographs(view: View, motion: Motion, options: SynthOptions) -> Iterator[Levels]:
    """Take the photographs in order of time: (H, W) uint8 or uint16 each.

    Memory holds the grains, their picture and one photograph, however long the series.
    """
    bed = fill_bed(options.rng(Purpose.GRAINS), view, motion, options)
    falls = options.rng(Purpose.AVALANCHES)
    canvas = bed.canvas(view.shape, options.air_grey)
    light = light_field(view.shape, vignetting=options.vignetting, gradient=options.gradient)
    for frame, (u, steps) in enumerate(zip(options.frames_u_mm, motion.frame_steps, strict=True)):
        bed.advance(motion, int(steps), falls)
        picture = canvas.draw(view.to_px(bed.positions_mm)) + np.float32(options.air_grey)
        cover = view.blade_cover(float(u), options.thickness_mm)
        picture += cover * (np.float32(options.blade_grey) - picture)
        picture *= light
        noise = options.rng(Purpose.NOISE, frame)
        levels = expose(picture, noise, noise_grey=options.noise_grey, bit_depth=options.bit_depth)
        yield levels if options.direction is Direction.RIGHT else cv2.flip(levels, 1)  # type: ignore[misc]
