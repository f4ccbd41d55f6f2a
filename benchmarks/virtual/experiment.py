"""A material-point run as a laboratory would have it: photographs, and its force through two made cells.

The run's force on the blade's face, times the width, is what the cells feel; friction on the box, zeros and
noise are added as in any made test. The run does not say at which height its force acts: a third of the depth
above the tip is taken, with the slow wander of made tests.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.scene import Soil
from ploughval.synth.logs import LogTruth, empty_truth, feel, log_table
from ploughval.synth.options import Purpose, SynthOptions
from virtual.photographs import OPTIONS, VirtualRun, make_virtual_folder

Floats = NDArray[np.float64]

TOLD = Soil(
    unit_weight_kN_m3=16.0,
    peak_friction_deg=50.0,
    residual_friction_deg=32.0,
    mobilization_length_mm=1.0,
    unit_weight_std_kN_m3=0.2,
    peak_friction_std_deg=2.0,
    residual_friction_std_deg=1.0,
    mobilization_length_std_mm=0.3,
)
"""The run's own sand, with the standard uncertainties that a laboratory's tests would leave."""

RATE_HZ = 500.0
_REST_MARGIN_S = 0.5


def read_force(folder: Path, name: str = "mpm_d30_s2") -> tuple[Floats, Floats]:
    """Travel (K,) mm and the force (K,) on the blade's face, N a metre of width."""
    table = pd.read_csv(folder / f"{name}_force.csv")
    return 1e3 * table["u_m"].to_numpy(), table["P_front_N_per_m"].to_numpy()


def make_experiment(folder: Path, run: VirtualRun, force: tuple[Floats, Floats]) -> LogTruth:
    """Write a whole test folder; what the blade felt, row for row of the log, is returned.

    Parameters
    ----------
    folder : Path
        To be made.
    run : VirtualRun
        Particles of every photograph.
    force : (K,) mm and (K,) N/m
        Travel and force a width.
    """
    options = replace(OPTIONS, displacement_mm=float(run.u_mm[-1]), rate_hz=RATE_HZ)
    make_virtual_folder(folder, run, options, told=TOLD, start_s=options.rest_s)
    felt = felt_by_blade(force, options)
    (folder / "empty").mkdir(exist_ok=True)
    log_table(felt, options.rng(Purpose.LOG), options).to_csv(folder / "loadcells.csv", index=False)
    for number in range(1, options.empty_runs + 1):
        table = log_table(empty_truth(felt), options.rng(Purpose.LOG, number), options)
        table.to_csv(folder / "empty" / f"run{number}.csv", index=False)
    with (folder / "test.toml").open("a", encoding="utf-8") as settings:
        settings.write(cell_settings(options))
    return felt


def felt_by_blade(force: tuple[Floats, Floats], options: SynthOptions) -> LogTruth:
    """Force for the options' width and its line of action, row for row of the log."""
    u_mm, per_metre = force
    width_m = options.width_mm / 1e3
    return feel(u_mm, per_metre * width_m, options.rng(Purpose.LINE_OF_ACTION), options)


def cell_settings(options: SynthOptions) -> str:
    """The tables [loadcells] and [model] of test.toml."""
    return f"""
[loadcells]
log = "loadcells.csv"
empty = ["empty/*.csv"]
spacing_mm = {options.spacing_mm}
lower_to_tip_mm = {options.lower_to_tip_mm}
rest_s = [0.0, {options.rest_s - _REST_MARGIN_S}]

[model]
direction = "least_force"
"""


def state_direction(folder: Path, direction: str) -> None:
    """Let the folder's settings tell another rule for the direction of a fresh band."""
    path = folder / "test.toml"
    lines = path.read_text(encoding="utf-8").splitlines()
    told = [f'direction = "{direction}"' if 'direction = "least' in line else line for line in lines]
    path.write_text("\n".join(told) + "\n", encoding="utf-8")
