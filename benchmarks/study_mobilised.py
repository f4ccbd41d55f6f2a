"""Coverage of the mobilised friction and of what is read from it, over made tests with known softening.

python benchmarks/study_mobilised.py --tests TESTS --out reports/validation --virtual-test MPM

The tests are those of hundred_tests.py. Force, bands and surface are the measured ones of their results; the
truth is the softening law that moved their sand, at the true slip. The virtual test is the folder of the
material-point run (virtual_experiment.py), processed: there the friction of the sand is known, not its law.
"""

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from drawing.png import lighten
from known_error.errors import measured_tables
from model_study.virtual import davis
from ploughval.compare.force.curve import measured_curve
from ploughval.compare.softening.table import FrictionFindings, read_friction
from ploughval.report.figures import SofteningLine, mobilised_figure
from ploughval.report.figures.style import INK, new_figure, saved, styled
from ploughval.scene import Scene, load_scene
from ploughval.synth import Truth, load_truth

Floats = NDArray[np.float64]
NORMAL_95 = 1.959964
DILATION_DEG = 18.0  # of the material-point run's sand at its peak; 0 at its residual
SAME_BAND_MM = 1.0  # between the start of a measured and of a true band
QUANTITIES = {
    "peak": ("peak", "deg", "peak_friction_deg"),
    "residual": ("residual", "deg", "residual_friction_deg"),
    "length": ("length", "mm", "mobilization_length_mm"),
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Read every test; write mobilised-rows.csv, mobilised-softening.csv and mobilised-coverage.csv."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tests", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--virtual-test", type=Path, help="the material-point run, processed")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args(arguments)
    folders = sorted(path.parent.parent for path in options.tests.glob("[0-9]*/results/run.json"))
    with ProcessPoolExecutor(options.workers) as pool:
        done = [one for one in pool.map(measure, folders) if one is not None]
    rows = pd.concat([one[0] for one in done], ignore_index=True)
    softening = pd.concat([one[1] for one in done], ignore_index=True)
    options.out.mkdir(parents=True, exist_ok=True)
    summary = pd.DataFrame([*row_coverage(rows), *softening_coverage(softening)])
    for name, table in (("rows", by_band(rows)), ("softening", softening), ("coverage", summary)):
        table.to_csv(options.out / f"mobilised-{name}.csv", index=False, float_format="%.4g")
    draw_errors(softening, options.out / "mobilised-errors.png")
    if options.virtual_test is not None:
        read = virtual(options.virtual_test, options.out / "mobilised-virtual.png")
        read.to_csv(options.out / "mobilised-virtual.csv", index=False, float_format="%.4g")
        print(read.T.to_string())
    print(f"{len(done)} tests of {len(folders)}")
    print(summary.to_string(index=False))


def measure(folder: Path) -> tuple[pd.DataFrame, pd.DataFrame] | None:
    """Errors of the rows of one test, and what was read from them beside what is true."""
    read = friction_of(folder)
    if read is None:
        return None
    truth = load_truth(folder)
    scene, found, bands = read
    return _rows(folder.name, found.curve, bands, truth), _read(folder.name, found.softening, truth, scene)


def friction_of(folder: Path) -> tuple[Scene, FrictionFindings, pd.DataFrame] | None:
    """Settings, friction and bands of a processed test, from its result files; None where one is missing."""
    scene = load_scene(folder, files=False)
    found = measured_tables(folder)
    if found.force is None or found.bands is None or found.surface is None:
        return None
    force = measured_curve(found.force, scene.blade.depth_mm)
    if force is None:
        return None
    return scene, read_friction(scene, force, found.bands, found.surface, found.increments), found.bands


def virtual(folder: Path, picture: Path) -> pd.DataFrame:
    """What is read from the material-point run, beside the known friction and that on a plane after Davis."""
    read = friction_of(folder)
    assert read is not None
    scene, found, _ = read
    assert scene.soil is not None
    soil = scene.soil
    frames = found.curve.iloc[:0]  # the curve alone is drawn
    last = found.softening.iloc[-1]
    line = SofteningLine(last["peak_deg"], last["residual_deg"], last["length_mm"])
    known = SofteningLine(soil.peak_friction_deg, soil.residual_friction_deg, soil.mobilization_length_mm)
    lighten(saved(mobilised_figure(frames, found.curve, read=line, assumed=known), picture))
    return found.softening.assign(
        known_peak_deg=soil.peak_friction_deg,
        known_residual_deg=soil.residual_friction_deg,
        davis_peak_deg=davis(soil.peak_friction_deg, DILATION_DEG),
        davis_residual_deg=davis(soil.residual_friction_deg, 0.0),
    )


@styled
def draw_errors(softening: pd.DataFrame, picture: Path) -> None:
    """Errors of peak, residual and length of every test with their 95 % limits, in order of the truth."""
    last = softening.groupby("test").tail(1)
    figure = new_figure(2.9, width_in=8.4)
    for axes, (what, (_, unit, _)) in zip(figure.subplots(1, 3), QUANTITIES.items(), strict=True):
        part = last.dropna(subset=[f"{what}_{unit}"]).sort_values(f"true_{what}_{unit}")
        true = part[f"true_{what}_{unit}"].to_numpy()
        scale = true / 100 if unit == "mm" else 1.0
        value, low, high = (
            (part[name].to_numpy() - true) / scale
            for name in (f"{what}_{unit}", f"{what}_low_{unit}", f"{what}_high_{unit}")
        )
        axes.errorbar(np.arange(len(true)), value, yerr=[value - low, high - value], fmt="o", ms=2, lw=0.7)
        axes.axhline(0.0, color=INK, lw=0.8)
        axes.set_title(f"{what}: read less true, {'%' if unit == 'mm' else 'degrees'}")
        axes.set_xlabel("made tests, in order of the truth")
    lighten(saved(figure, picture))


def true_friction(slip_mm: Floats, truth: Truth) -> Floats:
    """The sand's friction after a slip, degrees."""
    soil = truth.options.soil
    share = np.clip(slip_mm / soil.mobilization_length_mm, 0.0, 1.0)
    return np.asarray(soil.peak_friction_deg - (soil.peak_friction_deg - soil.residual_friction_deg) * share)


def _rows(name: str, curve: pd.DataFrame, bands: pd.DataFrame, truth: Truth) -> pd.DataFrame:
    """Rows that lie on a true band: error against its friction at its slip."""
    parts = []
    for band, part in curve.groupby("band", sort=True):
        start = float(bands.set_index("band").loc[band, "u_start_mm"])
        near = (truth.bands["u_start_mm"] - start).abs()
        if near.min() > SAME_BAND_MM:
            continue
        true = truth.bands.loc[near.idxmin()]
        on = part[(part["u_mm"] > true["u_start_mm"]) & (part["u_mm"] < true["u_end_mm"])]
        slip = _true_slip(float(true["u_start_mm"]), on["u_mm"].to_numpy(), truth)
        error = on["phi_deg"].to_numpy() - true_friction(slip, truth)
        parts.append(
            on.assign(
                test=name, error_deg=error, true_slip_mm=slip, slip_error_mm=on["slip_mm"].to_numpy() - slip
            )
        )
    return pd.concat(parts, ignore_index=True) if parts else curve.iloc[:0].assign(test=name)


def _true_slip(start_mm: float, u_mm: Floats, truth: Truth) -> Floats:
    """Slip from a start to travels, by the true inclinations."""
    motion = truth.motion
    gathered = np.append(0.0, np.cumsum(motion.du_mm / np.cos(np.radians(motion.beta_deg))))
    ends = np.append(motion.u_mm, motion.u_mm[-1] + motion.du_mm[-1])
    return np.asarray(np.interp(u_mm, ends, gathered) - np.interp(start_mm, ends, gathered))


def _read(name: str, softening: pd.DataFrame, truth: Truth, scene: Scene) -> pd.DataFrame:
    """What was read from the curves, with the sand's own and the stated values beside it."""
    table = softening.assign(test=name, depth_mm=scene.blade.depth_mm)
    for what, (_, unit, key) in QUANTITIES.items():
        table[f"true_{what}_{unit}"] = getattr(truth.options.soil, key)
    return table


def by_band(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows summed up by test and band: a row is not independent of its neighbours."""
    z = rows["error_deg"] / rows["phi_std_deg"]
    marked = rows.assign(
        square=z**2, covered=(z.abs() <= NORMAL_95).astype(float), size=rows["error_deg"] ** 2
    )
    table = marked.groupby(["test", "band"]).agg(
        rows=("square", "size"),
        mean_error_deg=("error_deg", "mean"),
        rms_error_deg=("size", "mean"),
        median_std_deg=("phi_std_deg", "median"),
        rms_z=("square", "mean"),
        covered=("covered", "mean"),
    )
    table[["rms_error_deg", "rms_z"]] **= 0.5
    return table.reset_index()


def row_coverage(rows: pd.DataFrame) -> list[dict[str, object]]:
    """Share of rows whose 95 % interval holds the true friction, by stretches of slip; and of the slip."""
    z = (rows["error_deg"] / rows["phi_std_deg"]).abs()
    early = rows["true_slip_mm"] <= 1.0
    first = rows["test"] + "/" + rows["band"].astype(str)
    result: list[dict[str, object]] = []
    for name, some in (
        ("all rows", early | ~early),
        ("slip up to 1 mm", early),
        ("slip beyond 1 mm", ~early),
    ):
        share = (z[some] <= NORMAL_95).groupby(first[some]).mean()  # every band counts alike
        result.append(
            _line(
                f"phi, {name}",
                "deg",
                len(share),
                share.mean(),
                rows["error_deg"][some],
                rows["phi_std_deg"][some],
            )
        )
    slips = rows.groupby(["test", "band"]).first()
    inside = (slips["slip_error_mm"].abs() <= NORMAL_95 * slips["slip_std_mm"]).mean()
    result.append(
        _line(
            "slip at a band's start", "mm", len(slips), inside, slips["slip_error_mm"], slips["slip_std_mm"]
        )
    )
    return result


def softening_coverage(table: pd.DataFrame) -> list[dict[str, object]]:
    """Share of 95 % intervals that hold the true value: of single bands, and of what all bands tell."""
    last = table.groupby("test").tail(1).index
    result: list[dict[str, object]] = []
    for name, some in (("one band", table["band"] != "all"), ("a test", table.index.isin(last))):
        for what, (_, unit, _) in QUANTITIES.items():
            part = table[some & table[f"{what}_{unit}"].notna()]
            true = part[f"true_{what}_{unit}"]
            inside = (part[f"{what}_low_{unit}"] <= true) & (true <= part[f"{what}_high_{unit}"])
            error = part[f"{what}_{unit}"] - true
            line = _line(f"{what}, {name}", unit, len(part), inside.mean(), error, part[f"{what}_std_{unit}"])
            result.append({**line, "not_determined": int(some.sum() - len(part))})
    return result


def _line(
    name: str, unit: str, count: int, covered: float, error: pd.Series, std: pd.Series
) -> dict[str, object]:
    """One line of the summary; its share's std is that of ``count`` draws."""
    return {
        "quantity": name,
        "unit": unit,
        "count": count,
        "covered_95": covered,
        "covered_std": float(np.sqrt(max(covered * (1 - covered), 1e-9) / max(count, 1))),
        "mean_error": error.mean(),
        "rms_error": float(np.sqrt((error**2).mean())),
        "median_std": std.median(),
    }


if __name__ == "__main__":
    main()
