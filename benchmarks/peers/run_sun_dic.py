"""Measures with SUN-DIC."""

from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from adaptor import MARGIN, STEP, SUBSET, Found, Picture, serve
from sundic import sundic
from sundic.post_process import getDisplacements
from sundic.settings import Settings


def measure(reference: Picture, current: Picture) -> Found:
    """Affine subsets and the spline of order 5; the rest is the package's default."""
    height, width = reference.shape
    edge = MARGIN - SUBSET // 2
    settings = Settings()
    settings.SubsetSize, settings.StepSize = SUBSET, STEP
    settings.ROI = [edge, edge, width - 2 * edge, height - 2 * edge]
    settings.ShapeFunctions, settings.InterpolationOrder = "Affine", 5
    with TemporaryDirectory() as folder:
        settings.ImageFolder = str(Path(folder) / "pictures")
        Path(settings.ImageFolder).mkdir()
        for name, picture in (("a.png", reference), ("b.png", current)):
            cv2.imwrite(str(Path(settings.ImageFolder) / name), picture, [cv2.IMWRITE_PNG_COMPRESSION, 0])
        results = str(Path(folder) / "results.sdic")
        sundic.planarDICLocal(settings, results)
        table = np.asarray(getDisplacements(results, 0)[0])
    moved = table[:, 3:5]
    return Found(table[:, 0:2], moved, np.isfinite(moved).all(axis=1))


if __name__ == "__main__":
    cv2.setNumThreads(1)
    raise SystemExit(serve("SUN-DIC", measure))
