"""Measures with the window deformation of OpenPIV."""

import numpy as np
from adaptor import STEP, SUBSET, Found, Picture, serve
from openpiv import windef
from openpiv.settings import PIVSettings

WINDOWS = (128, 64, *[SUBSET + 1] * 4)
"""Sides of the windows, px: two coarse passes, then four with the even number nearest to the subset."""


def measure(reference: Picture, current: Picture) -> Found:
    """Ever smaller windows; only the second picture is deformed, so the points are the reference's."""
    overlap = tuple(size // 2 if size > SUBSET + 1 else size - STEP for size in WINDOWS)
    settings = PIVSettings(
        windowsizes=WINDOWS, overlap=overlap, num_iterations=len(WINDOWS), deformation_method="second image",
        min_max_u_disp=(-100, 100), min_max_v_disp=(-100, 100),
    )  # fmt: skip
    x, y, u, v, flags = windef.simple_multipass(reference.astype(float), current.astype(float), settings)
    points = np.stack([x.ravel(), y[::-1].ravel()], axis=1)
    moved = np.stack([u.ravel(), -v.ravel()], axis=1)
    return Found(points, moved, np.isfinite(moved).all(axis=1) & (np.asarray(flags).ravel() == 0))


if __name__ == "__main__":
    raise SystemExit(serve("OpenPIV", measure))
