"""Sand images and whole test folders with exact truth, from a seed."""

from ploughval.synth.sand import Grains, render_grains, sand_texture

__all__ = ["Grains", "render_grains", "sand_texture"]
