"""The photographs of a synthetic test, one at a time."""

from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Direction
from ploughval.synth.bed import fill_bed
from ploughval.synth.discs import disc_cover
from ploughval.synth.motion import Motion
from ploughval.synth.options import Purpose, SynthOptions
from ploughval.synth.view import View, expose, light_field

Levels = NDArray[np.uint8] | NDArray[np.uint16]

MARKER_GREYS = (225.0, 35.0)
"""Of a marker's pale disc and of its dark dot."""


def photographs(view: View, motion: Motion, options: SynthOptions) -> Iterator[Levels]:
    """Take the photographs in order of time: (H, W) uint8 or uint16 each.

    Memory holds the grains, their picture and one photograph, however long the series.
    """
    bed = fill_bed(options.rng(Purpose.GRAINS), view, motion, options)
    falls = options.rng(Purpose.AVALANCHES)
    canvas = bed.canvas(view.shape, options.air_grey)
    light = light_field(view.shape, vignetting=options.vignetting, gradient=options.gradient)
    markers = view.marker_places_px(options.markers, options.marker_radius_px)
    for frame, (u, steps) in enumerate(zip(options.frames_u_mm, motion.frame_steps, strict=True)):
        bed.advance(motion, int(steps), falls)
        creep_x, creep_y = options.camera_creep_px
        now = view.moved((creep_x * frame, creep_y * frame))
        picture = canvas.draw(now.to_px(bed.positions_mm)) + np.float32(options.air_grey)
        cover = now.blade_cover(float(u), options.thickness_mm)
        picture += cover * (np.float32(options.blade_grey) - picture)
        for x, y in markers:
            _paint(picture, (x + creep_x * frame, y + creep_y * frame), options.marker_radius_px)
        picture *= light
        noise = options.rng(Purpose.NOISE, frame)
        levels = expose(picture, noise, noise_grey=options.noise_grey, bit_depth=options.bit_depth)
        yield levels if options.direction is Direction.RIGHT else cv2.flip(levels, 1)  # type: ignore[misc]


def _paint(picture: NDArray[np.float32], centre_px: tuple[float, float], radius_px: float) -> None:
    """Paint a dark dot on a pale disc of twice its radius."""
    for radius, grey in ((2 * radius_px, MARKER_GREYS[0]), (radius_px, MARKER_GREYS[1])):
        cover = disc_cover(picture.shape, centre_px, radius).astype(np.float32)
        picture += cover * (np.float32(grey) - picture)
