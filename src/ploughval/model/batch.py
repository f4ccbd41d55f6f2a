"""Force histories of many scenes over threads, for studies and fits."""

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor

from ploughval.errors import ConfigError, Fault, PloughvalError
from ploughval.model.collapse import ForceHistory, force_history
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
        A tolerance or a number of threads that is not positive.
    """
    faults = []
    if tolerance is not None and not tolerance > 0.0:
        faults.append(Fault("tolerance", repr(tolerance), "a positive number"))
    if workers < 1:
        faults.append(Fault("workers", repr(workers), "at least 1"))
    if faults:
        raise ConfigError("simulate_many", faults)

    def run(scene: Scene) -> ForceHistory | PloughvalError:
        try:
            return force_history(scene, displacement_mm=displacement_mm, tolerance=tolerance)
        except PloughvalError as error:
            return error.with_traceback(None)  # a traceback would keep every frame of the run alive

    if workers == 1:
        return tuple(map(run, scenes))
    with ThreadPoolExecutor(workers, thread_name_prefix="model") as pool:
        return tuple(pool.map(run, scenes))
