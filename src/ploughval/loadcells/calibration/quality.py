"""How good the cells are, each figure with its definition (after the ideas of ISO 376:2011 and ASTM E74)."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.loadcells.calibration.fit import Session, fit_model
from ploughval.loadcells.calibration.fitted import ResponseFit
from ploughval.loadcells.calibration.models import MODELS

Floats = NDArray[np.float64]
Words = NDArray[np.str_]
QUALITY_COLUMNS = ("quantity", "cell", "value", "unit", "percent_of_full_scale", "definition", "note")
LIMIT_SHARE = 0.01
"""Expanded relative uncertainty at the lower limit of use."""
_CELLS = ("upper", "lower")
_LEVEL = 1e-3  # of full scale: moments as near as that are one level

_DEFINITIONS = {
    "full scale": "largest known moment",
    "linearity": "largest mean deviation of a level on the way up from the weighted straight line",
    "hysteresis": "largest difference between down and up at one level of one run",
    "return to zero": "largest change of the zero from the first to the last unloaded row of a run",
    "repeatability": "standard deviation of rows at one level and direction, zeros taken off",
    "reproducibility": "standard deviation of the runs' sensitivities, times full scale",
    "standard error": "standard deviation of the residuals beyond what weights and arms explain",
    "resolution": "step in which the readings are written",
    "cross-talk": "largest part of the moment that comes from the other cell's reading",
    "attenuation": "most that is lost at full scale if all scatter is in the readings",
    "lower limit": f"least value with an expanded (95 %) uncertainty within {100 * LIMIT_SHARE:g} % of it",
}


def quality_table(
    session: Session,
    fitted: ResponseFit,
    direction: Words,
    *,
    spacing_mm: float,
    lower_to_tip_mm: float,
) -> pd.DataFrame:
    """Quality figures of both cells, and the least force that they measure.

    Parameters
    ----------
    session, fitted : Session, ResponseFit
        The calibration and what was found from it.
    direction : (N,) str
        up or down.
    spacing_mm, lower_to_tip_mm : float, mm
        Geometry of the cells, for the force at the level of the tip.

    Returns
    -------
    DataFrame
        QUALITY_COLUMNS; NaN with a note where the session does not tell.
    """
    fit = fitted.choice.fit
    used = np.ones(session.run.size, dtype=bool)
    used[list(fit.left_out)] = False
    indicated = fitted.response.moments(session.readings - fit.zeros[:, session.run])
    scale = np.abs(session.moments).max(axis=1)
    groups = _Groups(session, indicated, direction, used)
    straight = fit_model(session, MODELS[0], fit.left_out)
    none = np.full(2, np.nan)
    main = np.abs(np.array([fit.coefficients[k, k] for k in (0, 1)]))
    figures: dict[str, tuple[Floats, str]] = {
        "full scale": (scale, ""),
        "linearity": (
            none if straight is None else groups.linearity(straight.residuals),
            "no rows on the way up",
        ),
        "hysteresis": (groups.hysteresis(), "no level was read on the way up and down"),
        "return to zero": (groups.return_to_zero(), "no run has two unloaded rows"),
        "repeatability": (groups.repeatability(), "no level was read twice in the same direction"),
        "reproducibility": (fitted.spread.std * scale, "a single run"),
        "standard error": (fit.scatter_Nm, ""),
        "resolution": (session.resolution * main, ""),
        "cross-talk": (_cross_talk(session, fitted), "the model chosen has none"),
        "attenuation": (fitted.attenuation * scale, ""),
    }
    rows = [
        (name, cell, values[k], "N m", 100 * values[k] / scale[k], _DEFINITIONS[name], "" if finite else why)
        for name, (values, why) in figures.items()
        for k, cell in enumerate(_CELLS)
        for finite in [bool(np.isfinite(values[k]))]
    ]
    rows += _limits(session, fitted, scale, spacing_mm, lower_to_tip_mm)
    return pd.DataFrame(rows, columns=list(QUALITY_COLUMNS))


class _Groups:
    """Rows of the same run, level and direction; indicated moments (2, N) in N m."""

    def __init__(
        self, session: Session, indicated: Floats, direction: Words, used: NDArray[np.bool_]
    ) -> None:
        scale = np.abs(session.moments).max(axis=1, keepdims=True)
        self._level = np.round(session.moments / (_LEVEL * scale)).astype(int)
        self._zero = (self._level == 0).all(axis=0)
        self._indicated, self._direction, self._used, self._run = indicated, direction, used, session.run

    def _means(
        self, values: Floats, keys: list[tuple[object, ...]]
    ) -> dict[tuple[object, ...], list[Floats]]:
        parts: dict[tuple[object, ...], list[Floats]] = {}
        for k, key in enumerate(keys):
            if self._used[k]:
                parts.setdefault(key, []).append(values[:, k])
        return parts

    def _keys(self) -> Iterator[tuple[object, ...]]:
        yield from zip(self._run, self._level[0], self._level[1], self._direction, strict=True)

    def linearity(self, residuals: Floats) -> Floats:
        """Largest mean residual of a level on the way up, (2,)."""
        parts = self._means(residuals, [key[1:] for key in self._keys()])
        means = [np.mean(part, axis=0) for key, part in parts.items() if key[-1] == "up"]
        return np.asarray(np.abs(means).max(axis=0)) if means else np.full(2, np.nan)

    def hysteresis(self) -> Floats:
        """Largest difference between down and up, zero load apart, (2,)."""
        parts = self._means(self._indicated, list(self._keys()))
        pairs = [
            np.mean(part, axis=0) - np.mean(parts[(*key[:-1], "up")], axis=0)
            for key, part in parts.items()
            if key[-1] == "down" and (*key[:-1], "up") in parts and (key[1], key[2]) != (0, 0)
        ]
        return np.asarray(np.abs(pairs).max(axis=0)) if pairs else np.full(2, np.nan)

    def return_to_zero(self) -> Floats:
        """Largest change of the zero within a run, (2,)."""
        changes = []
        for run in np.unique(self._run):
            rows = np.flatnonzero(self._zero & self._used & (self._run == run))
            if rows.size > 1:
                changes.append(self._indicated[:, rows[-1]] - self._indicated[:, rows[0]])
        return np.asarray(np.abs(changes).max(axis=0)) if changes else np.full(2, np.nan)

    def repeatability(self) -> Floats:
        """Pooled standard deviation of repeated rows, zero load apart, (2,)."""
        parts = self._means(self._indicated, [key[1:] for key in self._keys()])
        repeated = [np.array(part) for key, part in parts.items() if len(part) > 1 and key[:2] != (0, 0)]
        if not repeated:
            return np.full(2, np.nan)
        squares: Floats = np.sum([((part - part.mean(axis=0)) ** 2).sum(axis=0) for part in repeated], axis=0)
        return np.asarray(np.sqrt(squares / sum(len(part) - 1 for part in repeated)))


def _cross_talk(session: Session, fitted: ResponseFit) -> Floats:
    fit = fitted.choice.fit
    if not fit.model.crossed:
        return np.full(2, np.nan)
    reach = np.abs(session.readings - fit.zeros[:, session.run]).max(axis=1)
    return np.asarray(np.abs([fit.coefficients[0, 1] * reach[1], fit.coefficients[1, 0] * reach[0]]))


def _limits(
    session: Session, fitted: ResponseFit, scale: Floats, spacing_mm: float, lower_to_tip_mm: float
) -> Iterator[tuple[str, str, float, str, float, str, str]]:
    """Lower limits of use of both moments, and of a force at the level of the tip."""
    from scipy.stats import t as student

    fit, response = fitted.choice.fit, fitted.response
    factor = float(student.ppf(0.975, response.dof))
    main = np.array([fit.coefficients[k, k] for k in (0, 1)])
    fixed = np.sqrt(fit.scatter_Nm**2 + (session.resolution * main) ** 2 / 12)
    name, why = "lower limit", "no value is known that well: the constants are too uncertain"

    def limit(std: float, relative: float) -> float:
        room = LIMIT_SHARE**2 - (factor * relative) ** 2
        return factor * std / float(np.sqrt(room)) if room > 0 else float("nan")

    slopes = response.slopes(np.zeros(2))
    for k, cell in enumerate(_CELLS):
        reading = np.zeros((2, 1))
        reading[k] = scale[k] / main[k]
        f = response.features(reading)[:, 0]
        value = limit(float(fixed[k]), float(np.sqrt(f @ response.cov[k, :, k, :] @ f) / scale[k]))
        note = "" if np.isfinite(value) else why
        yield name, cell, value, "N m", 100 * value / scale[k], _DEFINITIONS[name], note
    levers = np.array([lower_to_tip_mm + spacing_mm, lower_to_tip_mm]) / 1000
    largest = float((scale / levers).min())
    f = response.features(np.asarray(np.linalg.solve(slopes, largest * levers))[:, None])[:, 0]
    both = np.array([1.0, -1.0]) * 1000 / spacing_mm
    spread = float(np.sqrt(max(np.einsum("c,k,ckdl,d,l->", both, f, response.cov, both, f), 0.0)))
    value = limit(float(np.sqrt((both**2 * fixed**2).sum())), spread / largest)
    note = "force at the level of the tip" if np.isfinite(value) else why
    yield name, "force", value, "N", 100 * value / largest, _DEFINITIONS[name], note
