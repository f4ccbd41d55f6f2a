"""ploughval: measurements and model validation for blade-in-sand (ploughing) laboratory tests.

``process`` and ``simulate`` do what the commands of the same names do; ``load_scene`` reads a test.toml.
Nothing heavy is imported until one of them is called.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ploughval.model import History
    from ploughval.run import Outcome
    from ploughval.scene import Scene

__all__ = ["load_scene", "process", "simulate"]


def load_scene(path: Path | str) -> "Scene":
    """Read and validate a test folder's settings; see :func:`ploughval.scene.load_scene`."""
    from ploughval.scene import load_scene as load

    return load(path)


def process(folder: Path | str, *, out: Path | str | None = None, **options: Any) -> "Outcome":
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
    Outcome
        Where results and report are, what was lost, the metrics.

    Raises
    ------
    PloughvalError
        When the input is refused.
    """
    from ploughval.run.urls import is_url

    if is_url(folder) or is_url(out):
        from ploughval.run.remote.ranges import run_staged

        return run_staged(process, folder, out=out, **options)

    from ploughval.report import write_single
    from ploughval.run import process_folder
    from ploughval.watch import unheard

    heard = options.get("progress", unheard)
    return process_folder(folder, out=out, page=lambda results: write_single(results, heard), **options)


def simulate(
    scene: "Scene", *, displacement_mm: float | None = None, tolerance: float | None = None
) -> "History":
    """Run the incremental-collapse model of a scene; see :func:`ploughval.model.simulate`."""
    from ploughval.model import simulate as run

    return run(scene, displacement_mm=displacement_mm, tolerance=tolerance)
