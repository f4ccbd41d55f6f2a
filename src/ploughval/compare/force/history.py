"""Two force histories against each other: level, shape, phase, and their distributions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.compare.area import area_metric
from ploughval.compare.ensemble import std_about
from ploughval.compare.force.alignment import aligned_u, log_stretch
from ploughval.compare.force.curve import Curve
from ploughval.compare.force.pairs import Pairs
from ploughval.compare.force.reading import Reading
from ploughval.compare.validation import NAN, Metric, distance, rms

Floats = NDArray[np.float64]
_MOST_POINTS = 5000


@dataclass(frozen=True, slots=True)
class Histories:
    """Both histories at the same even travels, and the model's with drawn inputs; N.

    ``u_mm``, ``measured``, ``measured_std``, ``model``, ``numerical_std`` are (M,), ``drawn`` is (N, M).
    """

    u_mm: Floats
    measured: Floats
    measured_std: Floats
    model: Floats
    numerical_std: Floats
    drawn: Floats

    @property
    def input_std(self) -> Floats:
        """What the inputs leave open of the model's force, (M,)."""
        return std_about(self.model, self.drawn)


def common_histories(measured: Curve, model: Curve, drawn: Sequence[Curve]) -> Histories:
    """Both curves at even steps over the travel that both cover."""
    limit = min(measured.end_mm, model.end_mm)
    start = max(float(measured.u_mm[0]), float(model.u_mm[0]))
    step = max(measured.step_mm, model.step_mm, (limit - start) / _MOST_POINTS)
    u = np.linspace(start, limit, max(int((limit - start) / step), 1) + 1)
    runs = np.array([one.at(u)[0] for one in drawn]).reshape(-1, u.size)
    return Histories(u, *measured.at(u), *model.at(u), runs)


def history_metrics(
    histories: Histories,
    measured: Reading,
    model: Reading,
    drawn: Sequence[Reading],
    pairs: Pairs,
    P0_N: float,
) -> list[Metric]:
    """Differences of the two histories over their common travel (docs/theory-comparison.md, Eq. (7)).

    Parameters
    ----------
    histories : Histories
        Both at the same travels.
    measured, model : Reading
        Both sides' peaks and initial forces.
    drawn : sequence of Reading
        The model's with drawn inputs.
    pairs : Pairs
        Matched switches.
    P0_N : float
        Force that normalises both, so that their ratio is kept.
    """
    if measured.begin_mm >= histories.u_mm[-1]:
        return [Metric("force_rms_P0", "P0", note="record and model share no travel")]
    error = histories.model - histories.measured
    stds = [rms(std) / P0_N for std in (histories.measured_std, histories.numerical_std, histories.input_std)]
    note = f"both over the model's P0, over {histories.u_mm[-1]:.4g} mm of travel"
    whole = distance(
        "force_rms_P0",
        rms(error) / P0_N,
        experiment_std=stds[0],
        numerical_std=stds[1],
        input_std=stds[2],
        note=note,
    )
    return [
        whole,
        *_area(histories, P0_N, note),
        *_shape(histories, measured, model, drawn),
        *_phase(histories, drawn, pairs, P0_N),
    ]


def _area(histories: Histories, P0_N: float, note: str) -> list[Metric]:
    """The area metric, averaged over the travel."""
    runs = histories.drawn if len(histories.drawn) else histories.model[None]
    area = float(np.nanmean(area_metric(histories.measured, histories.measured_std, runs)))
    said = f"area between the distributions of measured force and of {len(runs)} runs; {note}"
    found = {"area_validation_P0": area / P0_N}
    mean = float(np.nanmean(histories.measured))
    if mean > 0:  # of a force that is no load there is no share
        found["area_validation_percent"] = 100 * area / mean
    return [
        distance(name, value, experiment_std=NAN, numerical_std=NAN, note=said)
        for name, value in found.items()
    ]


def _shape(histories: Histories, measured: Reading, model: Reading, drawn: Sequence[Reading]) -> list[Metric]:
    """Difference of the histories, each over its own initial force."""
    own, theirs = measured.initial.force_N, model.initial.force_N
    if not (own > 0 and theirs > 0):
        return []
    ratio, predicted = histories.measured / own, histories.model / theirs
    shared = measured.curve.shared
    fresh = measured.initial.force_std_N**2 - shared.variance(own)
    noise = float(np.median(measured.curve.noise_std_N))
    variance = noise**2 + ratio**2 * max(fresh, 0.0) + (shared.offset_N * (1 - ratio)) ** 2
    scales = np.array([one.initial.force_N for one in drawn])
    runs = histories.drawn / scales[:, None] if len(scales) else histories.drawn
    return [
        distance(
            "force_shape_rms_P0",
            rms(predicted - ratio),
            experiment_std=rms(np.sqrt(variance) / own),
            numerical_std=rms(histories.numerical_std) / theirs,
            input_std=rms(std_about(predicted, runs)),
            note="each side over its own initial force",
        )
    ]


def _phase(histories: Histories, drawn: Sequence[Reading], pairs: Pairs, P0_N: float) -> list[Metric]:
    """What is left when matched switches coincide, the share that goes, and how far travel is stretched.

    docs/theory-comparison.md, Eqs (8) and (9).
    """
    if not pairs.numbers:
        return []
    to, place = pairs.places_mm
    same = np.interp(aligned_u(histories.u_mm, to, place), histories.u_mm, histories.model)
    runs = [
        np.interp(aligned_u(histories.u_mm, to, own[:, 0]), one.curve.u_mm, one.curve.force_N)
        if np.isfinite(own[:, 0]).all()
        else np.full(same.shape, NAN)
        for one, own in zip(drawn, pairs.drawn, strict=True)
    ]
    inside = aligned_u(histories.u_mm, to, place) <= histories.u_mm[-1]
    aligned = np.where(inside, same - histories.measured, NAN)
    inputs = std_about(same, np.array(runs).reshape(-1, same.size))
    count = len(pairs.numbers)
    switches = "the matched switch coincides" if count == 1 else f"{count} matched switches coincide"
    lacking = sum(not np.isfinite(own[:, 0]).all() for own in pairs.drawn)
    lack = f"; {lacking} of {len(pairs.drawn)} draws of the inputs lack a switch" if lacking else ""
    note = f"model's travel stretched so that {switches}{lack}"
    before = rms(np.where(inside, histories.model - histories.measured, NAN))
    gone = 1 - (rms(aligned) / before) ** 2 if before > 0 else NAN
    stretch = log_stretch(to, place)
    weight = np.diff(to, prepend=0.0) / to[-1]
    moved = np.array([np.abs(np.log(np.diff(own[:, 0], prepend=0.0) / np.diff(place, prepend=0.0))) @ weight
                      for own in pairs.drawn])  # fmt: skip
    lengths = np.diff(to, prepend=0.0)
    ends = np.hypot(pairs.measured_std[:, 0], np.append(0.0, pairs.measured_std[:-1, 0]))
    return [
        distance(
            "force_rms_aligned_P0",
            rms(aligned) / P0_N,
            experiment_std=rms(histories.measured_std) / P0_N,
            numerical_std=rms(histories.numerical_std) / P0_N,
            input_std=rms(inputs) / P0_N,
            note=note,
        ),
        Metric(
            "force_phase_share",
            "1",
            error=gone,
            note=f"share of the mean square difference that goes when {switches}",
        ),
        distance(
            "travel_stretch",
            float(np.abs(stretch) @ weight),
            experiment_std=rms(ends / lengths),
            numerical_std=float(np.max(pairs.numerical_std[:, 0] / place)),
            input_std=float(std_about(np.zeros(1), moved[:, None])[0]),
            note=f"mean |ln| of the stretch; {note}",
        ),
    ]
