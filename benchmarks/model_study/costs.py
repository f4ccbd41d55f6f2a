"""What a run of the model costs, and what other methods cost for the same displacement."""

import time
from collections.abc import Callable

# CPU seconds of other methods for u = 50 mm at d = 30 mm, measured once on one core of a 2-core machine:
# YADE 2023.02a with 8 664 and 5 524 grains, a Taichi MLS-MPM, the paper's scheme word by word.
OTHER_METHODS_S = {
    "DEM, 1.2 mm grains": 937.0,
    "DEM, 1.5 mm grains": 294.0,
    "MPM, 34 176 particles": 210.0,
    "the paper's scheme, pairwise avalanche": 13.0,
}
REPEATS = 7


def seconds(run: Callable[[], object], repeats: int = REPEATS) -> float:
    """Least time of a call that has been compiled: other work on the machine only adds to it."""
    run()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)
