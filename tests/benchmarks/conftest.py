"""One made test whose results are written by hand."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from ploughval.synth import EXAMPLE, Truth, adapt, make_folder

SMALL = adapt(EXAMPLE, soil={}, frames=12, mm_per_px=0.6, displacement_mm=22.0, rate_hz=20.0, noise_grey=1.0)


@dataclass(frozen=True)
class Made:
    """A made test and the folder for its results."""

    folder: Path
    results: Path
    truth: Truth
    scale: float = SMALL.mm_per_px

    def start_mm(self) -> np.ndarray:
        """Points over the sand."""
        x, y = np.meshgrid(np.arange(2.0, 110.0, 3.0), np.arange(2.0, 29.9, 1.5))
        return np.column_stack([x.ravel(), y.ravel()])

    def write_blade(self) -> None:
        """blade.csv without error."""
        table = self.truth.blade.assign(blade_x_mm=self.truth.blade["u_mm"], blade_std_mm=0.01)
        table[["frame", "time_s", "u_mm", "blade_x_mm", "blade_std_mm"]].to_csv(
            self.results / "blade.csv", index=False
        )

    def write_tracks(self, error_px: np.ndarray, std_px: float) -> None:
        """tracks.nc with an error (F, N, 2) px; points of sand that has gone are not valid."""
        start = self.start_mm()
        place = self.truth.positions(start) + error_px * self.scale
        gone = np.isnan(place[..., 0])
        dims = ("frame", "point")
        xr.Dataset(
            {
                "x0_mm": ("point", start[:, 0]),
                "y0_mm": ("point", start[:, 1]),
                "x_mm": (dims, place[..., 0]),
                "y_mm": (dims, place[..., 1]),
                "std_mm": (dims, np.full(gone.shape, std_px * self.scale)),
                "status": (dims, np.where(gone, 10, 0).astype(np.int8)),
            }
        ).to_netcdf(self.results / "tracks.nc", engine="h5netcdf")

    def write_table(self, name: str, table: pd.DataFrame) -> None:
        """One table of the results."""
        table.to_csv(self.results / f"{name}.csv", index=False)


@pytest.fixture(scope="session")
def made_once(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made") / "small"
    return folder, make_folder(folder, SMALL)


@pytest.fixture
def made(made_once, tmp_path):
    """The made test with an empty folder for results; its photographs are not to be changed."""
    folder, truth = made_once
    (tmp_path / "results").mkdir()
    made = Made(folder, tmp_path / "results", truth)
    made.write_blade()
    return made
