"""Rows that good practice asks for (Jones & Iadicola 2018), filled from settings and measurements."""

from ploughval.run.practice.equipment import shot_of
from ploughval.run.practice.table import good_practice

__all__ = ["good_practice", "shot_of"]
