"""A rig whose truth is known: every source of error is drawn, the forces that made the folder are kept."""

import numpy as np
import pandas as pd
import pytest

from ploughval.loadcells.bending import moments
from ploughval.scene import Scene

NAMES = ["time_s", "displacement_mm", "moment_upper_Nm", "moment_lower_Nm"]
REST, TRAVEL = 4.0, 20.0


def _true_force(u):
    return 30 + 8 * np.sin(u / 3)


def _true_arm(u):
    return 10 + 0.1 * u


class Rig:
    """Writes a test folder; every source of error is drawn from ``rng``, the truth stays known."""

    true_force, true_arm = staticmethod(_true_force), staticmethod(_true_arm)

    def __init__(
        self,
        folder,
        seed=0,
        *,
        noise=0.004,
        friction=3.0,
        scatter=0.0,
        spread=(0.0, 0.0, 0.0),
        runs=3,
        spacing=150.0,
        force=_true_force,
        after=0.0,
    ):
        self.folder, self.rng = folder, np.random.default_rng(seed)
        self.noise, self.friction, self.scatter = noise, friction, scatter
        self.nominal_spacing, self.after = spacing, after
        self.spacing_std, self.lower_std, self.gain_std = spread
        draw = self.rng.normal
        self.spacing = spacing + self.spacing_std * draw()
        self.lower = 260 + self.lower_std * draw()
        self.gain = 1 + self.gain_std * draw(size=2)
        self.zeros = draw(0, 0.2, 2)
        (folder / "empty").mkdir(exist_ok=True)
        self.table = self.run(force)
        self.table.to_csv(folder / "loadcells.csv", index=False)
        for k in range(runs):
            self.run(lambda u: 0 * u).to_csv(folder / f"empty/{k}.csv", index=False)

    def run(self, force):
        t = np.arange(0, REST + TRAVEL + self.after, 0.02)
        u = np.clip(t - REST, 0, TRAVEL)
        moving = (t > REST) & (t < REST + TRAVEL)  # unloaded from then on
        sand = moments(np.where(moving, force(u), 0.0), _true_arm(u), self.spacing, self.lower)
        level = self.friction * (1 + self.scatter * self.rng.normal())
        box = moments(np.where(moving, level, 0.0), np.full(t.size, 15.0), self.spacing, self.lower)
        cells = (np.stack(sand) + np.stack(box)) / self.gain[:, None] + self.zeros[:, None]
        cells += self.rng.normal(0, self.noise, cells.shape)
        shown = u + 3.0 + self.rng.normal(0, 0.002, t.size)
        return pd.DataFrame(np.column_stack([t, shown, cells.T]), columns=NAMES)

    def scene(self, **changes):
        calibration = {"upper_Nm_per_unit_std": self.gain_std, "lower_Nm_per_unit_std": self.gain_std}
        cells = {
            "log": "loadcells.csv",
            "empty": ["empty/*.csv"],
            "spacing_mm": self.nominal_spacing,
            "lower_to_tip_mm": 260.0,
            "spacing_std_mm": self.spacing_std,
            "lower_to_tip_std_mm": self.lower_std,
            "rest_s": [0.0, 3.9],
            "calibration": calibration,
        }
        return Scene.model_validate(
            {
                "folder": self.folder,
                "test": {"name": "t"},
                "blade": {"depth_mm": 30, "width_mm": 218},
                "loadcells": cells | changes,
            }
        )


def _errors(result, force=_true_force):
    """Rows in motion: u, error of the force, error of the line of action."""
    time = result.record["time_s"]
    record = result.record[(time > REST + 0.03) & (time < REST + TRAVEL)]
    u = record["time_s"].to_numpy() - REST
    return record, record["force_N"].to_numpy() - force(u), record["arm_mm"].to_numpy() - _true_arm(u)


@pytest.fixture(scope="session")
def made_rig():
    """Makes a rig in a folder."""
    return Rig


@pytest.fixture(scope="session")
def errors():
    """Rows in motion with the errors of force and line of action."""
    return _errors
