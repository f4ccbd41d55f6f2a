"""Soil parameters of a test folder fitted to its measured force."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ploughval.compare.force.curve import Curve, measured_curve
from ploughval.compare.force.parted import parted
from ploughval.disk import unwritable
from ploughval.errors import ConfigError, DataError, Fault
from ploughval.loadcells import ForceResult, measure_force
from ploughval.model.fit import PARAMETERS, Discrepancy, Extras, SharedErrors, SoilFit, fit_soil
from ploughval.model.fit.result import CURVE_COLUMNS, LANDSCAPE_COLUMNS, PROFILE_COLUMNS
from ploughval.run.kept.lock import locked
from ploughval.run.kept.written import write_csv, write_json
from ploughval.scene import load_scene
from ploughval.watch import Progress, unheard

UNCOMPENSATED = (
    "no empty-box runs: what rubs on the box is taken for the sand's force, which no interval allows for"
)


def fit_folder(
    folder: Path | str,
    *,
    results: Path | None = None,
    parameters: Sequence[str] = PARAMETERS,
    discrepancy: Discrepancy | None = None,
    samples: int = 0,
    progress: Progress = unheard,
) -> tuple[SoilFit, Path]:
    """Fit soil parameters to a test's force; write fit.json and fit_force, fit_profiles, fit_landscape.csv.

    Parameters
    ----------
    folder : path-like
        Test folder; its log is measured anew, so that no older result can speak for it.
    results : Path or None
        Result folder; None: ``results`` in the test folder.
    parameters : sequence of str
        Fields of [soil] to fit; the others keep their values within their standard uncertainties.
    discrepancy : Discrepancy or None
        How far the model may be from the sand; None: see :class:`ploughval.model.fit.Discrepancy`.
    samples : int
        Steps of a sampler beside the profiles (extra ``bayes``); 0: none.
    progress : callable
        Hears of (stage, done, total).

    Returns
    -------
    fit : SoilFit
        Values with intervals.
    path : Path
        The fit.json that was written.

    Raises
    ------
    ConfigError
        When the scene has no load cells or no soil to start from, or a parameter cannot be fitted.
    DataError
        When the log holds no motion, or a run is at work in the result folder.
    MissingExtraError
        Samples are wanted and emcee is not installed.
    """
    scene = load_scene(folder)
    if scene.loadcells is None or scene.soil is None:
        missing = "[soil]" if scene.soil is None else "[loadcells]"
        raise ConfigError(scene.source, [Fault(missing, "nothing", "a table", "A fit needs force and soil.")])
    results = scene.folder / "results" if results is None else results
    path = results / "fit.json"
    with locked(results):
        measured = measure_force(scene)
        curve = measured_curve(measured.record, scene.blade.depth_mm)
        if curve is None:
            log = ", ".join(scene.loadcells.log_patterns)
            raise DataError("holds no motion of the blade: a fit needs a force history", path=log)
        fitted = fit_soil(
            curve.u_mm,
            curve.force_N,
            curve.noise_std_N,
            scene,
            parameters=parameters,
            shared=shared_errors(curve, measured),
            discrepancy=discrepancy,
            extras=Extras(maps=True, samples=samples, progress=progress),
        )
        if measured.friction is None:
            fitted = replace(fitted, remarks=(*fitted.remarks, UNCOMPENSATED))
        _write_fit(path, fitted, scene.test.name)
    return fitted, path


def _write_fit(path: Path, fitted: SoilFit, test: str) -> None:
    """Write fit.json, which says that the tables are there: it goes first and comes last."""
    with unwritable(path):
        path.unlink(missing_ok=True)
    write_csv(path.with_name("fit_force.csv"), fitted.curve, CURVE_COLUMNS)
    write_csv(path.with_name("fit_profiles.csv"), fitted.profiles, PROFILE_COLUMNS)
    write_csv(path.with_name("fit_landscape.csv"), fitted.landscape, LANDSCAPE_COLUMNS)
    write_json(path, {"test": test, **fitted.to_json()})


def shared_errors(curve: Curve, measured: ForceResult) -> SharedErrors:
    """What is shared by all rows of a force record, as an offset, a gain and a start."""
    offset, gain = parted(curve)
    start = measured.contact.std_mm if measured.contact is not None else 0.0
    return SharedErrors(offset, gain, max(float(start), 0.0))
