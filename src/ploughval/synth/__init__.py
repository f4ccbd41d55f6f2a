"""Sand images and whole test folders with exact truth, from a seed."""

from ploughval.synth.folder import EXAMPLE, make_folder
from ploughval.synth.options import SynthOptions, adapt, options_like
from ploughval.synth.recorded import RECORDED, make_recorded
from ploughval.synth.sand import Grains, render_grains, sand_texture
from ploughval.synth.truth import Truth, load_truth

__all__ = [
    "EXAMPLE",
    "RECORDED",
    "Grains",
    "SynthOptions",
    "Truth",
    "adapt",
    "load_truth",
    "make_folder",
    "make_recorded",
    "options_like",
    "render_grains",
    "sand_texture",
]
