"""The incremental-collapse model of a scene (Kashizadeh et al. 2014, section 2.7)."""

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ploughval.axes import BAND_COLUMNS, MODEL_FORCE_COLUMNS
from ploughval.errors import DataError
from ploughval.model import layers as material
from ploughval.model.increments import Increments, surface_within
from ploughval.model.law import Law
from ploughval.model.march import End, March
from ploughval.model.mechanism import initial_force
from ploughval.model.settings import (
    increment_for,
    run_march,
    scene_law,
    soil_of,
    tolerance_of,
    travel_of,
)
from ploughval.scene import Scene, Soil

Floats = NDArray[np.float64]
log = logging.getLogger(__name__)

HALVINGS = 4


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """What the model predicts for a scene.

    Attributes
    ----------
    force : DataFrame of MODEL_FORCE_COLUMNS
        One row at the start of every increment, and one at the end; P of docs/theory-model.md, Eq. (3), for
        the blade's width.
    force_std_N : float
        Numerical standard uncertainty of the force (rms over the history): from doubling the increment, or
        what straight lines between the rows leave out, whichever is more.
    P0_N : float
        First force of one block in level sand, closed form.
    bands : DataFrame of BAND_COLUMNS
        One row a band, read where it starts; standard deviations are numerical.
    increments : sequence of Increment
        In order of displacement.
    end_reason : str
        Why the run ended: "displacement reached", or what stopped it.
    depth_mm : float, mm
        Depth of the blade.
    horizontal_share : float
        Cosine of wall friction plus inclination: load cells measure P times this.
    law, marched : Law, March
        The laws and the compiled march that surfaces and material points are read from.
    """

    force: pd.DataFrame
    force_std_N: float
    P0_N: float
    bands: pd.DataFrame
    increments: Increments
    end_reason: str
    depth_mm: float
    horizontal_share: float
    law: Law
    marched: March

    @property
    def end_mm(self) -> float:
        """Displacement at the end of the run, mm."""
        return float(self.marched.rows[-1, 0])

    def surface(self, u_mm: float) -> Floats:
        """Surface (M, 2) in world mm ahead of the blade at a displacement, starting at the face.

        Raises
        ------
        DataError
            The run does not reach this displacement.
        """
        u = self._inside(u_mm)
        k = self._increment_at(u)
        start, du = self.marched.rows[k, 0], u - self.marched.rows[k, 0]
        before = self.increments.surface_before(k)
        if du <= 1e-12 * self.depth_mm or start + self.marched.rows[k, 1] <= start:
            return before
        return surface_within(before, self.marched.rows[k], du, self.law)

    def advect(self, points_mm: ArrayLike, u_from_mm: float, u_to_mm: float) -> Floats:
        """Where material points (N, 2) that stand in the sand at ``u_from_mm`` stand at ``u_to_mm``.

        Returns
        -------
        (N, 2) float, mm
            NaN for sand that has avalanched: it left the surface at some increment.

        Raises
        ------
        DataError
            The run does not reach these displacements, or they run backwards.
        """
        start, stop = self._inside(u_from_mm), self._inside(u_to_mm)
        if stop < start:
            raise DataError(
                f"u_to_mm {u_to_mm} lies before u_from_mm {u_from_mm}; give them in order of travel"
            )
        points = np.array(points_mm, float).reshape(-1, 2)
        last = self._increment_at(stop)
        partial = self.surface(stop)
        slack = 1e-9 * self.depth_mm
        material.carry(points, self.marched, self.law, (start, stop, last), partial, slack)
        return points

    def layers(self, heights_mm: Sequence[float], u_mm: ArrayLike, frames: ArrayLike) -> pd.DataFrame:
        """Tracer layers of given initial heights at several displacements, a DataFrame of LAYER_COLUMNS.

        A row with empty x, y: there a layer is torn or avalanched, or the run does not reach so far.
        """
        return material.layer_table(self, heights_mm, np.atleast_1d(u_mm), np.atleast_1d(frames))

    def _inside(self, u_mm: float) -> float:
        u, slack = float(u_mm), 1e-6 * self.depth_mm
        if not -slack <= u <= self.end_mm + slack:
            raise DataError(
                f"displacement {u_mm} mm is outside the model run, 0 to {self.end_mm:.6g} mm "
                f"({self.end_reason}); ask for less or simulate further"
            )
        return min(max(u, 0.0), self.end_mm)

    def _increment_at(self, u: float) -> int:
        """Number of the increment in which a displacement lies; the last row at the end."""
        return int(np.searchsorted(self.marched.rows[:, 0], u, side="right")) - 1


class ForceHistory(NamedTuple):
    """Force alone.

    Attributes
    ----------
    u_mm : (R,) float64, mm
        Displacement of the blade.
    force_N : (R,) float64, N
        Force P of the model for the blade's width.
    band : (R,) int64
        Number of the band that slips, from 0.
    """

    u_mm: Floats
    force_N: Floats
    band: NDArray[np.int64]


def simulate(
    scene: Scene, *, displacement_mm: float | None = None, tolerance: float | None = None
) -> History:
    """Run the incremental-collapse model of a scene.

    Parameters
    ----------
    scene : Scene
        Must have [soil].
    displacement_mm : float or None, mm
        Travel of the blade; None: the scene's, or three depths.
    tolerance : float or None
        Relative numerical error aimed at; None: the scene's.

    Returns
    -------
    History
        Up to the travel, or to where the box ends (see ``end_reason``).

    Raises
    ------
    ConfigError
        The scene has no soil, or an initial surface that cannot be used; a travel or a tolerance that is
        not positive or asks for too many increments.
    ConvergenceError
        No mechanism is possible at the start.
    """
    soil = soil_of(scene)
    law, travel = scene_law(scene, soil), travel_of(scene, displacement_mm)
    aim, depth = tolerance_of(scene, tolerance), scene.blade.depth_mm
    scale = 1e-6 * soil.unit_weight_kN_m3 * scene.blade.width_mm
    step = increment_for(scene, travel, aim)
    coarse = run_march(scene, law, travel, 2.0 * step, store=False)
    for _ in range(HALVINGS):
        fine = run_march(scene, law, travel, step, store=False)
        error = compare_marches(coarse, fine, soil.mobilization_length_mm)
        if error <= aim * fine.rows[:, 2].max():
            break
        step, coarse = 0.5 * step, fine
    else:
        step *= 2.0
        log.warning("model: force still changes by %.2g of its greatest", error / fine.rows[:, 2].max())
    fine = run_march(scene, law, travel, step, store=True)
    force_N = scale * fine.rows[:, 2]
    reasons = {
        End.DONE: "displacement reached",
        End.NO_ROOM: "the next shear band would pass the end of the box",
    }
    return History(
        force=_force_table(fine, force_N),
        force_std_N=scale * max(error, march_error(coarse, fine), chord_error(fine)),
        P0_N=_level_force(scene, soil),
        bands=_band_table(fine, coarse),
        increments=Increments(fine, force_N),
        end_reason=reasons.get(End(fine.end), "no shear band is possible any more"),
        depth_mm=depth,
        horizontal_share=math.cos(law.wall),
        law=law,
        marched=fine,
    )


def force_history(
    scene: Scene, *, displacement_mm: float | None = None, tolerance: float | None = None
) -> ForceHistory:
    """Force of the model without surfaces, bands or error estimate, for scans of many scenes.

    Parameters
    ----------
    scene : Scene
        Must have [soil].
    displacement_mm : float or None, mm
        Travel of the blade; None: the scene's, or three depths.
    tolerance : float or None
        Relative numerical error that sets the increment; None: the scene's.

    Returns
    -------
    ForceHistory

    Raises
    ------
    ConfigError
        As for :func:`simulate`.
    ConvergenceError
        No mechanism is possible at the start.
    """
    soil, travel = soil_of(scene), travel_of(scene, displacement_mm)
    step = increment_for(scene, travel, tolerance_of(scene, tolerance))
    rows = run_march(scene, scene_law(scene, soil), travel, step, store=False).rows
    scale = 1e-6 * soil.unit_weight_kN_m3 * scene.blade.width_mm
    return ForceHistory(rows[:, 0].copy(), scale * rows[:, 2], rows[:, 6].astype(np.int64))


def compare_marches(coarse: March, fine: March, mobilization_mm: float) -> float:
    """Rms difference of P / unit weight between two steps while the same band is active and has softened."""
    a, b = coarse.rows, fine.rows
    b = b[b[:, 0] <= a[-1, 0]]
    near = np.searchsorted(a[:, 0], b[:, 0], side="right") - 1
    after = np.minimum(near + 1, len(a) - 1)
    same = (a[near, 6] == b[:, 6]) & (a[after, 6] == b[:, 6])
    slip = np.minimum(a[near, 7], b[:, 7])
    soft = slip >= mobilization_mm
    if mobilization_mm == 0.0 or np.mean(soft) < 0.2:
        soft = slip > 0.0
    gap = (np.interp(b[:, 0], a[:, 0], a[:, 2]) - b[:, 2])[same & soft]
    return float(np.sqrt(np.mean(gap**2))) if gap.size else 0.0


def march_error(coarse: March, fine: March) -> float:
    """Rms over the whole history of what P / unit weight differs by between two steps, switches included.

    docs/theory-model-march.md, Eq. (4): errors are of first order, so it is the rms error of the finer run.
    """
    a, b = coarse.rows, fine.rows
    b = b[b[:, 0] <= a[-1, 0]]
    if len(b) < 2:
        return 0.0
    square = (np.interp(b[:, 0], a[:, 0], a[:, 2]) - b[:, 2]) ** 2
    return float(np.sqrt(np.trapezoid(square, b[:, 0]) / b[-1, 0]))


def chord_error(fine: March) -> float:
    """Rms over the whole history of what straight lines between its rows leave out of P / unit weight.

    While a band softens its steps do not shrink with the increment, so that doubling it does not show this.
    The deviation of a parabola of curvature c from its chord over a length h has the rms c h^2 / sqrt(120)
    (docs/theory-model-march.md, Eq. (5)). The curvature at a row is the second divided difference among rows
    of one band, of the two ends of a step the lesser one, so that a fall at once is no curvature of the step
    after it.
    """
    u, force, band = fine.rows[:, 0], fine.rows[:, 2], fine.rows[:, 6]
    if len(u) < 3:
        return 0.0
    step = np.diff(u)
    slope = np.diff(force) / step
    bend = np.abs(np.diff(slope)) * 2.0 / (step[1:] + step[:-1])
    bend[(band[2:] != band[1:-1]) | (band[1:-1] != band[:-2])] = np.inf
    least = np.minimum(np.append(bend, np.inf), np.append(np.inf, bend))
    least[~np.isfinite(least)] = 0.0
    return float(np.sqrt(np.sum(least**2 * step**5) / 120.0 / u[-1]))


def _level_force(scene: Scene, soil: Soil) -> float:
    """First force in level sand, N for the blade's width."""
    angles = soil.peak_friction_deg, soil.wall_friction_deg
    weight, surcharge = 1e-6 * soil.unit_weight_kN_m3, 1e-3 * soil.surcharge_kPa
    return scene.blade.width_mm * initial_force(
        scene.blade.depth_mm,
        weight,
        *angles,
        inclination_deg=scene.blade.inclination_deg,
        surcharge=surcharge,
    )


def _starts(marched: March) -> NDArray[np.int64]:
    """Rows at which bands start."""
    return np.flatnonzero(np.diff(marched.rows[:, 6], prepend=-1.0))


def _force_table(marched: March, force_N: Floats) -> pd.DataFrame:
    u, _, _, tan_beta, x, _, band = marched.rows.T[:7]
    columns = (u, force_N, np.degrees(np.arctan(tan_beta)), x, band.astype(np.int64))
    return pd.DataFrame(dict(zip(MODEL_FORCE_COLUMNS, columns, strict=True)))


def _band_table(fine: March, coarse: March) -> pd.DataFrame:
    rows, starts = fine.rows, _starts(fine)
    beta = np.degrees(np.arctan(rows[:, 3]))
    x, top, _, _, joint_x, joint_y, forward = rows.T[4:]
    slip = rows[:, 1] * forward * np.hypot(1.0, (top - joint_y) / (x - joint_x))
    other = _starts(coarse)
    common = min(len(starts), len(other))
    stds = np.full((2, len(starts)), np.nan)
    coarse_beta = np.degrees(np.arctan(coarse.rows[other[:common], 3]))
    stds[0, :common] = np.abs(beta[starts[:common]] - coarse_beta)
    stds[1, :common] = np.abs(rows[starts[:common], 4] - coarse.rows[other[:common], 4])
    ends = np.append(rows[starts[1:], 0], rows[-1, 0])
    gathered = np.add.reduceat(slip, starts)
    columns = (
        np.arange(len(starts)),
        rows[starts, 0],
        ends,
        beta[starts],
        stds[0],
        rows[starts, 4],
        stds[1],
        gathered,
    )
    return pd.DataFrame(dict(zip(BAND_COLUMNS, columns, strict=True)))
