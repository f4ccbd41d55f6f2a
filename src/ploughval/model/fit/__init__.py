"""Soil parameters from a measured force history: objective, search, intervals, what tells what."""

from ploughval.model.fit.objective import Discrepancy, SharedErrors
from ploughval.model.fit.result import SoilFit
from ploughval.model.fit.soil import Extras, fit_soil
from ploughval.model.fit.variables import FITTED, PARAMETERS

__all__ = ["FITTED", "PARAMETERS", "Discrepancy", "Extras", "SharedErrors", "SoilFit", "fit_soil"]
