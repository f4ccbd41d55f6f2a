"""Force histories of many scenes over threads, for studies and fits."""

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor

from ploughval.errors import ConfigError, Fault, PloughvalError
from ploughval.model.collapse import ForceHistory, force_history
from ploughval.model.settings import tolerance_of
from ploughval.scene import Scene


def simulate_many(
    scenes: Iterable[Scene],
    *,
    displacement_mm: float | None = None,
    tolerance: float | None = None,
    workers: int = 1,
) -> tuple[ForceHistory | PloughvalError, ...]:
    """Force histories of many scenes, as :func:`force_history` gives them one by one.

    Parameters
    ----------
    scenes : iterable of Scene
        Each must have [soil].
    displacement_mm : float or None, mm
        Travel of the blade in every scene; None: each scene's own, or three depths.
    tolerance : float or None
        Relative numerical error aimed at in every scene; None: each scene's own.
    workers : int
        Threads; the numbers do not depend on it.

    Returns
    -------
    tuple, one entry a scene, in their order
        A ForceHistory, or the error that :func:`force_history` raised for a scene that cannot be modelled.

    Raises
    ------
    ConfigError
        A tolerance that cannot be, or a number of threads that is not positive.
    """
    if workers < 1:
        raise ConfigError("simulate_many", [Fault("workers", repr(workers), "at least 1")])
    scenes = tuple(scenes)
    if scenes:
        tolerance_of(scenes[0], tolerance)

    def run(scene: Scene) -> ForceHistory | PloughvalError:
        try:
            return force_history(scene, displacement_mm=displacement_mm, tolerance=tolerance)
        except PloughvalError as error:
            return error.with_traceback(None)  # a traceback would keep every frame of the run alive

    if workers == 1:
        return tuple(map(run, scenes))
    with ThreadPoolExecutor(workers, thread_name_prefix="model") as pool:
        return tuple(pool.map(run, scenes))
