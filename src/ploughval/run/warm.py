"""Compile the kernels ahead of their first use: ``python -m ploughval.run.warm``, once after installation.

Compiled code is kept beside the sources (or where NUMBA_CACHE_DIR says); two processes share the work.
"""

import multiprocessing
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np


def warm() -> None:
    """Compile the kernels of correlation in one process, all others in a second one."""
    parts: tuple[Callable[[], None], ...] = (warm_correlation, warm_geometry_and_model)
    with ProcessPoolExecutor(len(parts), mp_context=multiprocessing.get_context("spawn")) as pool:
        for future in [pool.submit(part) for part in parts]:
            future.result()


def warm_correlation() -> None:
    """Match two pictures of sand that a shear band crosses: every kernel of correlation is called."""
    from ploughval.piv import correlate
    from ploughval.synth import sand_texture

    shape = (160, 160)
    grains = sand_texture(np.random.default_rng(1), shape, margin_px=40)
    torn = np.where(grains.positions_px[:, 1:] < shape[0] / 2, [3.0, 0.0], [0.0, 0.0])
    first, second = (g.picture(shape).astype(np.uint8) for g in (grains, grains.moved(torn)))
    rows, columns = np.mgrid[24:137:8, 24:137:8]
    correlate(first, second, np.column_stack([columns.ravel(), rows.ravel()]))


def warm_geometry_and_model() -> None:
    """Make a small test and look at its photographs."""
    from ploughval.photos import calibrate, open_frames
    from ploughval.scene import load_scene
    from ploughval.synth import EXAMPLE, make_folder
    from ploughval.tracers import Watcher

    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "test"
        make_folder(folder, replace(EXAMPLE, frames=3, displacement_mm=4.0))
        scene = load_scene(folder)
        frames = open_frames(scene)
        watcher = Watcher(scene, calibrate(scene, frames))
        for frame in range(len(frames)):
            watcher.see(frame, frames.read(frame))


if __name__ == "__main__":
    warm()
