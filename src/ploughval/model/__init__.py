"""The incremental-collapse model: force, shear bands, free surface and tracer layers of a scene."""

from ploughval.model.collapse import ForceHistory, History, Increment, force_history, simulate

__all__ = ["ForceHistory", "History", "Increment", "force_history", "simulate"]
