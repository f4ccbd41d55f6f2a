"""The band finder on sand that no block model moved: a material-point run of the same scene."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from ploughval.scene import Blade, Camera, Scene, TestTable
from ploughval.tracers import find_bands

FOLDER = Path(__file__).resolve().parents[4] / "shared" / "virtual"
SPACING_MM = 0.125  # of pixels: a subset of 31 px is three cells of the run's grid
POINTS = 5000

pytestmark = pytest.mark.skipif(
    not (FOLDER / "mpm_d30_s2_frames.npz").is_file(), reason="needs the virtual experiment"
)


@pytest.fixture(scope="module")
def found():
    with np.load(FOLDER / "mpm_d30_s2_frames.npz") as run:
        blade, radius = run["blade"] * 1e3, float(np.median(run["r"])) * 1e3
        origin = np.array([blade[0, 0], blade[0, 2]])
        chosen = np.random.default_rng(0).choice(run["xy"].shape[1], POINTS, replace=False)
        place = run["xy"] * 1e3 - origin
    u = blade[:, 0] - blade[0, 0]
    height = 30.0
    shape = (len(u), POINTS)
    own = place[:, chosen]
    tracks = xr.Dataset(
        {
            "x_mm": (("frame", "point"), own[..., 0]),
            "y_mm": (("frame", "point"), own[..., 1]),
            "std_mm": (("frame", "point"), np.full(shape, 1e-3)),
            "zncc": (("frame", "point"), np.ones(shape)),
            "status": (("frame", "point"), np.zeros(shape, np.int8)),
            "u_mm": ("frame", u),
        },
        coords={"frame": np.arange(len(u))},
    )
    rows = [
        (k, u[k], x, place[k][np.abs(place[k][:, 0] - x) < 1.0, 1].max() + radius, 0.3)
        for k in range(len(u))
        for x in np.arange(u[k] + 1.0, 200.0, 1.0)
        if (np.abs(place[k][:, 0] - x) < 1.0).any()
    ]
    surface = pd.DataFrame(rows, columns=["frame", "u_mm", "x_mm", "y_mm", "std_mm"])
    scene = Scene(
        test=TestTable(name="virtual"),
        blade=Blade(depth_mm=height, width_mm=200),
        camera=Camera(photos="*.png", mm_per_px=SPACING_MM, tip_px=(0, 0)),
    )
    return find_bands(tracks, surface, scene)


def test_two_bands_are_found_and_the_second_starts_where_the_force_falls(found):
    """The run's force falls at u = 25.5 mm; its frames are 2.5 mm apart."""
    assert len(found.bands) == 2
    assert found.bands["u_start_mm"].iloc[1] == pytest.approx(25.5, abs=2.5)


def test_inclinations_follow_the_run_s_own_measure_of_its_peak_shear(found):
    """Both steepen, from 30 to 52 and from 24 to 40 degrees; a zone several mm wide has no sharper line."""
    true = pd.read_csv(FOLDER / "mpm_d30_s2_bands.csv")
    rows = found.increments.iloc[: len(true)]
    off = rows["beta_deg"].to_numpy() - true["inclination_deg"].to_numpy()
    assert np.median(np.abs(off)) < 3.0
    # the increment in which the bands change over has motion on both
    switch = int(np.argmin(np.abs(true["u0_m"] * 1e3 - 25.0)))
    assert np.abs(np.delete(off, switch)).max() < 9.0


def test_no_increment_is_taken_for_a_single_sharp_band(found):
    """Its zones are several mm wide, sand below the tip moves too, and the block dilates: none is rigid."""
    moving = found.increments.dropna(subset=["beta_deg"])
    assert (moving["mechanism"] != "one_band").all()
    assert moving["beta_std_deg"].median() > 1.0
