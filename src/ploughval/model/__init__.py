"""The incremental-collapse model: force, shear bands, free surface and tracer layers of a scene."""

from ploughval.model.batch import simulate_many
from ploughval.model.collapse import ForceHistory, History, force_history, simulate
from ploughval.model.fit import SoilFit, fit_soil
from ploughval.model.increments import Increment

__all__ = [
    "ForceHistory",
    "History",
    "Increment",
    "SoilFit",
    "fit_soil",
    "force_history",
    "simulate",
    "simulate_many",
]
