"""What Python users hold: the results of a test and a run of the model, with tables, figures and exports."""

from ploughval.notebook.plots import Plots
from ploughval.notebook.result import ModelTables, Result, load_results
from ploughval.notebook.simulation import Simulation, SimulationPlots, simulate

__all__ = [
    "ModelTables",
    "Plots",
    "Result",
    "Simulation",
    "SimulationPlots",
    "load_results",
    "simulate",
]
