"""Small tables of every bench, as the page of speed against error reads them."""

from pathlib import Path

import pytest

TABLES = {
    "piv-settings.csv": """case,subset,order,spline,shape,step_px,workers,points,points_s,cpu_us,rmse_px,bias_px,times_bound,near_rmse_px,star_period_px,valid
""",  # noqa: E501
    "sequences.csv": """family,setting,default,points,photographs,cpu_ms,wall_ms,median_px,p95_px,wrong_pct,not_tracked_pct,within_1_std
subset,21,False,100,10,80,90,0.02,0.1,0,30,0.7
subset,31,True,100,10,100,110,0.01,0.05,0,32,0.7
subset,41,False,100,10,150,160,0.009,0.045,0,33,0.7
spacing,30,False,30,10,50,60,0.01,0.051,0,33,0.7
photographs,1,True,100,10,100,110,0.01,0.05,0,32,0.7
photographs,2,False,100,5,140,150,0.012,0.06,0,36,0.7
reference,renewed where needed,True,100,10,100,110,0.01,0.05,0,32,0.7
reference,always the first,False,100,10,300,310,0.02,1.5,6,60,0.6
reference,always the last,False,100,10,70,75,0.04,2.0,12,4,0.6
threads,1,True,100,10,100,110,0.01,0.05,0,32,0.7
threads,2,False,100,10,105,55,0.01,0.05,0,32,0.7
""",  # noqa: E501
    "force-settings.csv": """family,setting,default,rows,seeds,force_rms_percent,bound_percent,arm_rms_mm,force_coverage_95_percent,cpu_ms,wall_ms
"bandwidth, Hz",none,True,5000,100,1.2,1.19,4.6,96,40,40
"bandwidth, Hz",2,False,5000,100,0.3,,1.0,98,44,44
"bandwidth, Hz",0.5,False,5000,100,0.9,,0.5,99,50,50
rows a second,20,True,1000,100,1.15,1.2,0.5,95,30,30
rows a second,500,False,25000,100,1.16,1.2,0.5,95,120,120
empty runs,1,False,1000,100,1.4,1.46,0.7,13,17,17
empty runs,3,True,1000,100,1.15,1.2,0.5,95,30,30
empty runs,10,False,1000,100,1.05,1.09,0.5,95,80,80
friction taken off,per cell,True,1000,100,1.15,1.2,0.5,95,30,30
friction taken off,force only,False,1000,100,1.15,1.2,0.98,95,31,31
""",  # noqa: E501
    "model-settings.csv": """family,setting,default,switch_error_pct,peak_error_pct,force_rms_pct,cpu_ms,wall_ms
tolerance,0.01,False,0.31,0.46,0.63,0.7,0.7
tolerance,0.001,True,0.032,0.047,0.067,1.9,1.9
tolerance,0.0001,False,0.0029,0.0043,0.0062,15,15
"increment, d",0.05,False,0.31,0.46,0.63,0.09,0.09
"increment, d",0.005,True,0.032,0.047,0.067,0.53,0.53
"nodes added, d apart",0.03,False,0.032,0.047,0.067,13,13
"search over nodes, d apart",0.1,False,0.79,0.92,4.5,2,2
""",  # noqa: E501
    "fit-settings.csv": """family,setting,default,seeds,angles_deg,length_pct,stated_deg,hold_pct,cpu_s,wall_s
rows of the record,100,False,4,0.6,4.1,0.5,90,3.1,3.1
rows of the record,300,True,4,0.5,1.4,0.4,92,4.0,4.0
rows of the record,1000,False,4,0.49,1.2,0.4,92,7.0,7.0
local searches,1,False,4,0.5,1.4,0.4,92,3.0,3.0
local searches,6,True,4,0.5,1.4,0.4,92,4.0,4.0
samples of the cover,64,False,4,0.5,1.4,0.4,92,3.5,3.5
samples of the cover,2048,True,4,0.5,1.4,0.4,92,4.0,4.0
model allowed to be off,no,False,4,0.9,2.0,0.2,40,3.6,3.6
model allowed to be off,"3 %, 1 %",True,4,0.5,1.4,0.4,92,4.0,4.0
"objective, simplex",squares,False,4,0.9,2.5,,,0.8,0.8
"objective, simplex",registered,True,4,0.6,2.0,,,0.6,0.6
""",
    "compare.csv": """draws,rms_error_percent,p95_error_percent,force_comparison_s,clock_s
16,7.0,13,0.15,0.15
64,2.4,4.4,0.41,0.41
256,1.0,2.1,1.8,1.8
""",
}
CASES = {"shift 0.25 noise 3": 0.008, "affine": 0.0014, "band 4 px tanh noise 3": 0.016, "star": 0.09}
SETTINGS = (
    (21, 1, 5, "adaptive", 16, 1, 1.5, 0.9),
    (31, 1, 5, "adaptive", 16, 1, 1.0, 1.0),
    (41, 1, 5, "adaptive", 16, 1, 0.75, 1.4),
    (31, 1, 5, "adaptive", 8, 1, 0.99, 0.7),
    (31, 1, 5, "adaptive", 16, 2, 1.0, 1.0),
    (31, 1, 5, "fixed", 16, 1, 1.0, 1.0),
    (31, 0, 5, "fixed", 16, 1, 1.0, 0.9),
    (31, 2, 5, "fixed", 16, 1, 1.9, 1.3),
    (31, 1, 3, "fixed", 16, 1, 1.1, 0.85),
)
"""Subset, order, spline, shape, step, threads; error and time over the default's."""


def _write_tables(folder: Path) -> Path:
    """Write all of them into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in TABLES.items():
        (folder / name).write_text(text, encoding="utf-8")
    with (folder / "piv-settings.csv").open("a", encoding="utf-8") as file:
        for case, error in CASES.items():
            for subset, order, spline, shape, step, workers, worse, slower in SETTINGS:
                near = f"{4 * worse * error:.4g}" if case.startswith("band") else ""
                period = f"{46 * worse:.4g}" if case == "star" else ""
                speed = 40000 * workers**0.6 / slower
                cells = (
                    case,
                    subset,
                    order,
                    spline,
                    shape,
                    step,
                    workers,
                    2745,
                    f"{speed:.5g}",
                    f"{25 * slower:.4g}",
                )
                file.write(
                    ",".join(map(str, (*cells, f"{error * worse:.4g}", 0.001, 1.05, near, period, 1))) + "\n"
                )
    return folder


def _write_some(folder: Path, *names: str) -> Path:
    """Write those that are named alone: a page of few figures is soon made."""
    for path in _write_tables(folder).glob("*.csv"):
        if path.name not in names:
            path.unlink()
    return folder


@pytest.fixture(scope="session")
def write_tables():
    return _write_tables


@pytest.fixture(scope="session")
def write_some():
    return _write_some
