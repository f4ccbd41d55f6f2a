"""From tracks and photographs to geometry: blade, free surface, layers, shear bands."""

from ploughval.tracers.bands import BandFindings, find_bands
from ploughval.tracers.layers import layers_from_tracks
from ploughval.tracers.points import PointSet, place_points
from ploughval.tracers.volume import area_balance
from ploughval.tracers.watcher import Sight, Watcher

__all__ = [
    "BandFindings",
    "PointSet",
    "Sight",
    "Watcher",
    "area_balance",
    "find_bands",
    "layers_from_tracks",
    "place_points",
]
