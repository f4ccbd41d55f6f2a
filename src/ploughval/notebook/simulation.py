"""A run of the model in Python: the model's history, with units and figures."""

from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING

import xarray as xr

from ploughval.model import History
from ploughval.model import simulate as run_model
from ploughval.results import FILES, Results, RunRecord, table_dataset, with_units
from ploughval.run.results import model_tables
from ploughval.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(History):
    """What the model predicts for a scene, with the scene; ``attrs`` of its tables hold units and meanings.

    Attributes
    ----------
    scene : Scene
        What was simulated.
    """

    scene: Scene

    @cached_property
    def plot(self) -> "SimulationPlots":
        """Figures: ``simulation.plot.force()`` and others."""
        return SimulationPlots(self)

    def to_dataset(self) -> xr.Dataset:
        """The force as a dataset.

        Returns
        -------
        Dataset
            Dimension row; the columns of ``force`` with units and long_name; attributes P0_N, force_std_N,
            depth_mm, horizontal_share, end_reason.
        """
        dataset = table_dataset(self.force, FILES["model/force.csv"])
        names = ("P0_N", "force_std_N", "depth_mm", "horizontal_share", "end_reason")
        return dataset.assign_attrs({name: getattr(self, name) for name in names})

    def __repr__(self) -> str:
        bands = f"{len(self.bands)} shear band{'s' if len(self.bands) != 1 else ''}"
        reach = f"{bands} to u = {self.end_mm:.4g} mm, P0 = {self.P0_N:.4g} N"
        return f"<Simulation of {self.scene.test.name}: {reach}; {self.end_reason}>"


class SimulationPlots:
    """Figures of a run of the model, as they stand on the report page.

    Parameters
    ----------
    simulation : Simulation
        The run.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation

    def force(self) -> "Figure":
        """Force against displacement, as load cells would measure it, with the starts of bands."""
        from ploughval.report.figures import force_figure

        shown = self._results()
        return force_figure(
            None, shown.model_force, depth_mm=shown.depth_mm, P0_N=shown.P0_N, model_bands=shown.model_bands
        )

    def bands(self) -> "Figure":
        """Outcrop and inclination of the shear bands against displacement."""
        from ploughval.report.figures import bands_figure

        shown = self._results()
        return bands_figure(None, None, model_bands=shown.model_bands, model_force=shown.model_force)

    def layers(self, u_mm: float | None = None) -> "Figure":
        """Tracer layers and free surface.

        Parameters
        ----------
        u_mm : float or None, mm
            Displacement of the blade; None: the last.

        Raises
        ------
        DataError
            The run does not reach so far.
        """
        from ploughval.report.figures import layers_figure
        from ploughval.report.stages import stage_at, view

        u = self._simulation.end_mm if u_mm is None else u_mm
        self._simulation.surface(u)  # a displacement that is not reached is refused here
        shown = self._results(u)
        extent, stage = view(shown), stage_at(shown, 0)
        return layers_figure(
            stage.predicted,
            stage.measured,
            u_mm=stage.u_mm,
            depth_mm=self._simulation.depth_mm,
            extent=extent,
            thickness_mm=shown.thickness_mm,
        )

    def _results(self, u_mm: float | None = None) -> Results:
        """The run as the results of a test without measurements; lines at one displacement, as frame 0."""
        run = self._simulation
        tables = model_tables(run.scene, run, [run.end_mm if u_mm is None else u_mm])
        force = tables["force"].assign(force_N=tables["force"]["force_N"] * run.horizontal_share)
        record = RunRecord(test=run.scene.test.name, settings=run.scene.model_dump(mode="json"))
        return Results(
            run.scene.folder,
            record,
            model_force=force,
            model_bands=tables["bands"],
            model_layers=tables["layers"],
            model_surface=tables["surface"],
        )


def simulate(
    scene: Scene, *, displacement_mm: float | None = None, tolerance: float | None = None
) -> Simulation:
    """Run the model; what :func:`ploughval.simulate` hands on.

    Parameters
    ----------
    scene : Scene
        Must have [soil].
    displacement_mm : float or None, mm
        Travel of the blade; None: the scene's, or three depths.
    tolerance : float or None
        Relative numerical error aimed at; None: the scene's.

    Returns
    -------
    Simulation
    """
    history = run_model(scene, displacement_mm=displacement_mm, tolerance=tolerance)
    parts = {field.name: getattr(history, field.name) for field in fields(History)}
    for name in ("force", "bands"):
        parts[name] = with_units(parts[name], FILES[f"model/{name}.csv"])
    return Simulation(**parts, scene=scene)
