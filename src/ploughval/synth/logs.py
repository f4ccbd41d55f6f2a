"""Load-cell logs of a test and of its empty-box runs, from the true force and line of action.

A horizontal force F at height a above the tip bends a cell at height h with the moment F (h - a), so
that F = (M_upper - M_lower) / spacing and a = lower_to_tip - M_lower / F.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from ploughval.synth.motion import Floats
from ploughval.synth.options import SynthOptions

_FRICTION_ARM = 0.5
"""Height of the friction on the box above the tip, in depths: seals run along the blade's edges."""

_DISPLACEMENT_NOISE_MM = 0.002
_TAIL_S = 1.0


@dataclass(frozen=True, slots=True)
class LogTruth:
    """What the blade felt, row for row of the log.

    Attributes
    ----------
    time_s, u_mm, force_N : (T,) float64
        The force is the sand's horizontal resultant; 0 at rest.
    arm_mm : (T,) float64
        Height of its line of action above the tip; NaN at rest.
    """

    time_s: Floats
    u_mm: Floats
    force_N: Floats
    arm_mm: Floats


def feel(u_mm: Floats, force_N: Floats, rng: np.random.Generator, options: SynthOptions) -> LogTruth:
    """Sample the true force (against ``u_mm``, ascending) at the log's rate.

    The line of action lies at a third of the depth and wanders slowly by a few hundredths of it.
    """
    travel_s = options.displacement_mm / options.speed_mm_s
    count = int((options.rest_s + travel_s + _TAIL_S) * options.rate_hz) + 1
    time = np.arange(count) / options.rate_hz
    u = np.clip((time - options.rest_s) * options.speed_mm_s, 0.0, options.displacement_mm)
    moving = time > options.rest_s
    periods = options.depth_mm * np.array([0.6, 1.1, 2.3])
    phases, sizes = rng.uniform(0, 2 * np.pi, 3), rng.normal(0, 0.015, 3)
    wander = np.sin(2 * np.pi * u[:, None] / periods + phases) @ sizes
    force = np.where(moving, np.interp(u, u_mm, force_N), 0.0)
    arm = np.where(moving, options.depth_mm * (1 / 3 + wander), np.nan)
    return LogTruth(time, u, force, arm)


def bending_moments(
    force_N: Floats, arm_mm: Floats, *, spacing_mm: float, lower_to_tip_mm: float
) -> tuple[Floats, Floats]:
    """Moments (upper, lower), N m, of a horizontal force ``arm_mm`` above the tip.

    >>> bending_moments(10.0, 10.0, spacing_mm=150.0, lower_to_tip_mm=260.0)
    (4.0, 2.5)
    """
    lower = force_N * (lower_to_tip_mm - arm_mm) * 1e-3
    return lower + force_N * spacing_mm * 1e-3, lower


def log_table(truth: LogTruth, rng: np.random.Generator, options: SynthOptions) -> pd.DataFrame:
    """The log of a run that felt ``truth``: friction, zeros and noise added, columns as in test.toml."""
    moving = truth.time_s > options.rest_s
    friction = _friction(truth, moving, rng, options)
    geometry = {"spacing_mm": options.spacing_mm, "lower_to_tip_mm": options.lower_to_tip_mm}
    sand = bending_moments(truth.force_N, np.nan_to_num(truth.arm_mm), **geometry)
    box = bending_moments(friction, np.full(friction.shape, _FRICTION_ARM * options.depth_mm), **geometry)
    zeros = rng.normal(0, options.zero_offset_Nm, 2)
    noise = rng.normal(0, options.moment_noise_Nm, (2, len(friction)))
    upper, lower = (sand[c] + box[c] + zeros[c] + noise[c] for c in (0, 1))
    displacement = truth.u_mm + rng.normal(0, _DISPLACEMENT_NOISE_MM, len(moving))
    return pd.DataFrame(
        {
            "time_s": truth.time_s.round(4),
            "displacement_mm": displacement.round(4),
            "moment_upper_Nm": upper.round(5),
            "moment_lower_Nm": lower.round(5),
        }
    )


def empty_truth(truth: LogTruth) -> LogTruth:
    """The same motion without sand."""
    return LogTruth(
        truth.time_s, truth.u_mm, np.zeros_like(truth.force_N), np.full_like(truth.arm_mm, np.nan)
    )


def _friction(truth: LogTruth, moving: np.ndarray, rng: np.random.Generator, options: SynthOptions) -> Floats:
    """Friction on the box: one level for a run, scattered between runs, with the same trend along the box."""
    level = options.friction_N * (1 + options.friction_scatter * rng.standard_normal())
    trend = 1 + 0.03 * np.sin(2 * np.pi * truth.u_mm / options.displacement_mm)
    return np.where(moving, level * trend, 0.0)
