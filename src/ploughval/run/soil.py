"""Soil parameters of a test folder fitted to its measured force."""

from pathlib import Path

import numpy as np

from ploughval.compare.force.curve import measured_curve
from ploughval.errors import ConfigError, DataError, Fault
from ploughval.loadcells import measure_force
from ploughval.model.fit import SoilFit, fit_soil
from ploughval.run.store import write_json
from ploughval.scene import load_scene


def fit_folder(folder: Path | str, *, results: Path | None = None) -> tuple[SoilFit, Path]:
    """Fit peak and residual friction angle and mobilization length to a test's force.

    Parameters
    ----------
    folder : path-like
        Test folder; its log is measured anew, so that no older result can speak for it.
    results : Path or None
        Result folder; None: ``results`` in the test folder.

    Returns
    -------
    fit : SoilFit
        Values with standard uncertainties.
    path : Path
        The fit.json that was written.

    Raises
    ------
    ConfigError
        When the scene has no load cells or no soil to start from.
    DataError
        When the log holds no motion.
    """
    scene = load_scene(folder)
    if scene.loadcells is None or scene.soil is None:
        missing = "[soil]" if scene.soil is None else "[loadcells]"
        raise ConfigError(scene.source, [Fault(missing, "nothing", "a table", "A fit needs force and soil.")])
    results = scene.folder / "results" if results is None else results
    curve = measured_curve(measure_force(scene).record, scene.blade.depth_mm)
    if curve is None:
        log = ", ".join(scene.loadcells.log_patterns)
        raise DataError("holds no motion of the blade: a fit needs a force history", path=log)
    shared = float(np.median(curve.shared_std_N))
    fitted = fit_soil(curve.u_mm, curve.force_N, curve.noise_std_N, scene, shared_std_N=shared)
    path = results / "fit.json"
    write_json(path, {"test": scene.test.name, **fitted.to_json()})
    return fitted, path
