"""ploughval: measurements and model validation for blade-in-sand (ploughing) laboratory tests.

``process`` and ``simulate`` do what the commands of the same names do; ``load_scene`` reads a test.toml,
``load_results`` what was processed before. Nothing heavy is imported until one of them is called.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ploughval.notebook import Result, Simulation
    from ploughval.scene import Scene

__all__ = ["__version__", "load_results", "load_scene", "process", "simulate"]


def __getattr__(name: str) -> str:
    """The version, from the metadata of the installed package."""
    if name != "__version__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib.metadata import version

    return version("ploughval")


def load_scene(path: Path | str) -> "Scene":
    """Read and validate a test folder's settings.

    Parameters
    ----------
    path : path-like
        A test.toml, or the folder that holds one.

    Returns
    -------
    Scene
        Frozen; see :class:`ploughval.scene.Scene`.

    Raises
    ------
    ConfigError
        With every fault: file, key, value, what was expected.
    """
    from ploughval.scene import load_scene as load

    return load(path)


def load_results(folder: Path | str) -> "Result":
    """The results of a test that has been processed.

    Parameters
    ----------
    folder : path-like
        A result folder, or a test folder that holds ``results``.

    Returns
    -------
    Result
        As :func:`process` returned it: tables with units, tracks, figures, exports.

    Raises
    ------
    DataError
        No results there, or a record that cannot be read.
    """
    from ploughval.notebook import load_results as load

    return load(folder)


def process(folder: Path | str, *, out: Path | str | None = None, **options: Any) -> "Result":
    """Process one test folder up to its report page.

    Parameters
    ----------
    folder : path-like
        Test folder with a test.toml: a path, or the text of a URL (extra: cluster).
    out : path-like or None
        Result folder: a path, or the text of a URL; None: ``results`` in the test folder.
    **options
        workers, fresh and progress of :func:`ploughval.run.process_folder`.

    Returns
    -------
    Result
        Where results and report are, what was lost, the metrics; and the results themselves, read from their
        folder when they are asked for: tables with units, tracks, figures, exports.

    Raises
    ------
    PloughvalError
        When the input is refused.
    """
    from ploughval.notebook import Result
    from ploughval.run.urls import is_url

    if is_url(folder) or is_url(out):
        from ploughval.run.remote.ranges import run_staged

        return Result.of(run_staged(process, folder, out=out, **options))

    from ploughval.report import write_single
    from ploughval.run import process_folder
    from ploughval.watch import unheard

    heard = options.get("progress", unheard)
    outcome = process_folder(folder, out=out, page=lambda results: write_single(results, heard), **options)
    return Result.of(outcome)


def simulate(
    scene: "Scene", *, displacement_mm: float | None = None, tolerance: float | None = None
) -> "Simulation":
    """Run the incremental-collapse model of a scene.

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
        Force, shear bands, surface and layers of :class:`ploughval.model.History`, with units and figures.

    Raises
    ------
    ConfigError
        No soil, or values that cannot be used.
    ConvergenceError
        No mechanism is possible at the start.
    """
    from ploughval.notebook import simulate as run

    return run(scene, displacement_mm=displacement_mm, tolerance=tolerance)
