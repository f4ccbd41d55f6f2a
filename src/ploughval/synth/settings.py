"""The commented test.toml of a synthetic test, and the notes from which a user would write one."""

import json

import numpy as np
from numpy.typing import NDArray

from ploughval.scene import Soil
from ploughval.synth.options import SynthOptions


def settings_text(
    options: SynthOptions, tip_px: tuple[float, float], markers_px: NDArray[np.float64] | None = None
) -> str:
    """The text of test.toml: what a laboratory would know, not the truth where the two differ."""
    parts = [
        f"# A synthetic test, made from seed {options.seed}; its exact truth is in truth/.\n\n"
        f"[test]\nname = {json.dumps(options.name)}\nnotes = {json.dumps(_notes(options))}\n",
        _blade(options),
        _soil(options.soil if options.told_soil is None else options.told_soil),
    ]
    if options.photographs:
        parts.append(_camera(options, tip_px))
        if markers_px is not None and len(markers_px):
            parts.append(_markers(options, markers_px))
    if options.loadcells:
        parts.append(_loadcells(options))
    if options.layers_mm:
        parts.append(_tracers(options))
    return "\n".join(parts)


def _notes(options: SynthOptions) -> str:
    """What a reader of the report must know of such a test: which sand it was."""
    return (
        f"Made by ploughval synth from seed {options.seed}: its sand moves by the incremental-collapse model "
        "itself. Agreement says that the chain of measurement is right, not that the model describes real "
        "sand."
    )


def _blade(options: SynthOptions) -> str:
    box = f"\n[box]\nlength_mm = {options.box_length_mm!r}\n" if options.box_length_mm else ""
    return f"""\
[blade]
depth_mm = {options.depth_mm!r}
width_mm = {options.width_mm!r}                # out of plane; the force is for this width
thickness_mm = {options.thickness_mm!r}
speed_mm_s = {options.speed_mm_s!r}
{box}"""


def _soil(soil: Soil) -> str:
    stated = soil.model_dump(exclude_defaults=True)
    lines = [f"{key} = {value!r}" for key, value in stated.items()]
    return "\n".join(["[soil]", *lines, ""])


def _camera(options: SynthOptions, tip_px: tuple[float, float]) -> str:
    offset = repr(options.clock_offset_s) if options.clock_told else '"auto"'
    return f"""\
[camera]
photos = "photos/*.{options.image_format}"
times = "photos.csv"
mm_per_px = {options.mm_per_px!r}
tip_px = [{tip_px[0]!r}, {tip_px[1]!r}]          # blade face at tip level, before the blade moves
direction = "{options.direction.value}"
clock_offset_s = {offset}             # photograph clock minus log clock
"""


def _markers(options: SynthOptions, markers_px: NDArray[np.float64]) -> str:
    places = ",\n    ".join(f"[{x:.0f}.0, {y:.0f}.0]" for x, y in markers_px)
    return f"""\
[camera.markers]
radius_px = {options.marker_radius_px!r}
fixed_px = [                    # painted on the window; about where, in the first photograph
    {places},
]
"""


def _loadcells(options: SynthOptions) -> str:
    empty = '["empty/*.csv"]' if options.empty_runs else "[]"
    rest_end = options.rest_s - min(0.5, options.rest_s / 2)
    return f"""\
[loadcells]
log = "loadcells.csv"
empty = {empty}
spacing_mm = {options.spacing_mm!r}               # between the two cells
lower_to_tip_mm = {options.lower_to_tip_mm!r}          # lower cell above the blade's tip
rest_s = [0.0, {rest_end!r}]               # zeros and noise are read here
"""


def _tracers(options: SynthOptions) -> str:
    heights = ", ".join(repr(h) for h in options.layers_mm)
    dye = f"dyed = true\nthickness_mm = {options.layer_thickness_mm!r}\n" if options.dyed else ""
    return f"[tracers]\nlayers_mm = [{heights}]     # initial heights above the tip\n{dye}"


def notes_text(options: SynthOptions, dots_mm: NDArray[np.float64]) -> str:
    """What a laboratory notes beside photographs and logs: all that these do not tell.

    Parameters
    ----------
    options : SynthOptions
        What the test contains.
    dots_mm : (N, 2) float, mm
        Dots painted on the window, from the tip at rest.
    """
    soil = options.soil if options.told_soil is None else options.told_soil
    box = f"\nBox: {options.box_length_mm:g} mm long.\n" if options.box_length_mm else ""
    parts = [
        f"# {options.name}: notes of the day\n",
        f"Blade: {options.depth_mm:g} mm deep, {options.width_mm:g} mm wide out of plane, "
        f"{options.thickness_mm:g} mm thick.\n{box}",
        f"Sand: {soil.unit_weight_kN_m3:g} kN/m3; friction {soil.peak_friction_deg:g} degrees at the peak, "
        f"{soil.residual_friction_deg:g} residual, each known to half a degree.\n",
    ]
    if options.loadcells:
        parts.append(
            f"Load cells: {options.spacing_mm:g} mm apart, the lower one {options.lower_to_tip_mm:g} mm "
            "above the tip. Weights hung on the blade: calibration/cells.csv, readings in mV/V.\n"
        )
    if options.layers_mm:
        heights = ", ".join(f"{height:g}" for height in options.layers_mm)
        colour = f"dyed dark, {options.layer_thickness_mm:g} mm thick" if options.dyed else "not dyed"
        parts.append(f"Layers: {heights} mm above the tip, {colour}.\n")
    if options.photographs:
        parts.append("Camera: has its own clock.\n")
    if len(dots_mm):
        rows = "".join(f"| {k} | {x:.2f} | {y:.2f} |\n" for k, (x, y) in enumerate(dots_mm, start=1))
        parts.append(
            f"Dots on the window, radius {options.marker_radius_px * options.mm_per_px:.1f} mm, from the "
            f"tip at rest, along the travel and up:\n\n| dot | x, mm | y, mm |\n| --- | --- | --- |\n{rows}"
        )
    return "\n".join(parts)
