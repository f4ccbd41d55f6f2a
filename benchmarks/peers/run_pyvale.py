"""Measures with pyvale."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from adaptor import MARGIN, STEP, SUBSET, Found, Picture, serve
from pyvale import dic

THRESHOLD = 0.7
"""Least correlation: with the default of 0.9 the search for the seed gives up at low contrast."""


def measure(reference: Picture, current: Picture) -> Found:
    """Affine subsets; the package's defaults but for the threshold, below which vectors are not valid."""
    height, width = reference.shape
    edge = MARGIN - SUBSET // 2
    usable = np.zeros(reference.shape, dtype=np.bool_)
    usable[edge:-edge, edge:-edge] = True
    with TemporaryDirectory() as folder:
        dic.calculate_2d(
            reference=reference, deformed=current[None], roi_mask=usable, seed=[width // 2, height // 2],
            subset_size=SUBSET, subset_step=STEP, threshold=THRESHOLD, num_threads=1,
            output_basepath=folder, output_below_threshold=True, print_level=0,
        )  # fmt: skip
        results = dic.import_2d(
            str(Path(folder) / "dic_results_*"), delimiter=",", layout="column", print_level=0
        )
    points = np.stack([results.ss_x, results.ss_y], axis=1).astype(np.float64)
    moved = np.stack([results.u_px[0], results.v_px[0]], axis=1)
    valid = np.asarray(results.converged[0], dtype=np.bool_) & (results.cost[0] >= THRESHOLD)
    return Found(points, moved, valid)


if __name__ == "__main__":
    raise SystemExit(serve("pyvale", measure))
