"""Every plot function, for the page and for a paper: a Figure, no trace, units, one type, no overlap."""

import subprocess
import sys
from contextlib import nullcontext

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from ploughval.compare.several import Record, Value, depth_trends, group_tests, mean_errors, repeats_of
from ploughval.compare.several.groups import DEPTH
from ploughval.compare.several.histories import MeanHistory
from ploughval.errors import ConfigError
from ploughval.report import figures
from ploughval.report.figures.look import fitting_columns, paper_look
from ploughval.report.figures.shear import Band, ShearMap
from ploughval.report.figures.style import styled
from ploughval.report.stages import outcrops, view
from ploughval.results import read_results

WIDTHS_MM = (84.0, 174.0)
U = np.linspace(0.0, 30.0, 31)
PLOTS = sorted(name for name in figures.__all__ if name.endswith("_figure"))
# Axis labels that name a quantity without a unit, and why: ratios, counts, and levels of a camera.
DIMENSIONLESS = {
    "u / d", "P / P₀", "P / own P₀", "P / P₀, measured", "P / P₀, predicted",  # over depth and initial force
    "P / (γd²B/2)\nat equal travel", "P / (γd²B/2)\nswitches aligned",
    "E / u_val", "E / u_val (grey: agrees)", "E / u_val, model − experiment (grey band: a test agrees)",
    "share", "share of u_val²",
    "model − experiment",  # of several quantities, whose units stand in the titles
    "band", "missed, std", "rise of the cost", "log₁₀ (1 + rise of the cost)",
    "displacement of the sand / displacement of the blade", "area of heap / swept",
    "grey level", "noise, grey levels",
    "maximum shear strain over 6.00 mm",
    "First peak over its\nscale at 33 mm",
}  # fmt: skip
UNITS = (", mm", ", N", ", °", ", N m", ", %", ", px", ", mm/mm", ", mm²", ", 1", ", ‰", ", kN/m³")


@pytest.fixture(scope="module")
def results(result_folder):
    return read_results(result_folder)


@pytest.fixture(scope="module")
def several():
    """Trend, repeats, mean errors and mean history of made tests."""
    records = [
        Record(
            f"d{depth:g}",
            {"blade": {"depth_mm": depth, "width_mm": 200.0}, "soil": {"unit_weight_kN_m3": 16.0}},
            {"first_peak_N": Value("N", force, 0.02 * force, 1.01 * force, 0.1, 0.01 * force, 0.3, True)},
        )
        for depth, forces in {20.0: (3.4, 3.5), 30.0: (7.6, 7.9), 60.0: (30.5, 31.1)}.items()
        for force in forces
    ]
    grouping = group_tests(records)
    (series,) = grouping.along(DEPTH)
    forces = np.array([1.0 + U / 20, 1.1 + U / 20])
    mean, std = forces.mean(axis=0), forces.std(axis=0, ddof=1)
    history = MeanHistory(
        (0, 1), "γd²B/2", U / 30, forces, mean, std, std, forces, mean, std, np.empty((2, 0)), (0, 0), ()
    )
    trend = depth_trends(series, records)[0]
    return trend, repeats_of(grouping.groups[0], records), mean_errors(range(6), records), history


def sides(results):
    cut = [None if t is None else t[t["frame"] == 8] for t in (results.model_layers, results.layers)]
    surface = results.surface[results.surface["frame"] == 8]
    ends = outcrops(results.bands, 40.0)
    return figures.Side(cut[0], None, ends), figures.Side(cut[1], surface, ends)


PARAMETERS = ("peak_friction_deg", "residual_friction_deg", "mobilization_length_mm")


def pairs_table():
    """Three pairs of bands, of which one differs by more than is stated."""
    pairs = pd.DataFrame({"band_experiment": [1.0, 2.0, 3.0], "band_model": [1.0, 2.0, 3.0]})
    for name in ("u_start_mm", "life_mm", "beta_deg", "ahead_mm"):
        pairs[f"{name}_difference"], pairs[f"{name}_validation_std"] = [0.2, -0.3, 1.4], 0.4
    return pairs


def mound_table():
    """The heap of both sides over the displacement."""
    mound = pd.DataFrame({"source": np.repeat(["experiment", "model"], U.size), "u_mm": np.tile(U, 2)})
    for name in ("crest_mm", "face_mm", "front_mm", "flank_deg", "slope_deg", "area_mm2"):
        mound[name] = np.tile(40 * U, 2)
        mound[f"{name.rsplit('_', 1)[0]}_std_{name.rsplit('_', 1)[1]}"] = 12.0
    return mound


def cells_table():
    """Two runs of known moments, up and down."""
    moment = np.array([0.0, 5.0, 10.0, 5.0])
    cells = pd.DataFrame({"file": "a.csv", "row": range(8), "run": list("11112222"), "used": True,
                          "direction": ["up", "up", "up", "down"] * 2})  # fmt: skip
    for cell in ("upper", "lower"):
        cells[f"moment_{cell}_Nm"] = np.tile(moment, 2)
        cells[f"residual_{cell}_Nm"] = 0.01 * np.cos(np.arange(8))
    return cells


def profiles_table():
    """Rise of the cost beside the best value of each parameter."""
    steps = np.linspace(-0.1, 0.1, 5)
    return pd.DataFrame(
        [{"parameter": n, "value": b * (1 + s), "rise": 400 * s**2}
         for n, b in zip(PARAMETERS, (50, 32, 1), strict=True) for s in steps]
    )  # fmt: skip


def landscape_table():
    """Rise of the cost over each pair of parameters."""
    x, y = (v.ravel() for v in np.meshgrid(np.linspace(45, 55, 5), np.linspace(28, 36, 4)))
    return pd.concat(
        pd.DataFrame({"map": f"{a} x {b}", "x": x, "y": y, "rise": (x - 50) ** 2 + (y - 32) ** 2})
        for a, b in (PARAMETERS[:2], PARAMETERS[::2], PARAMETERS[1:])
    )


@pytest.fixture(scope="module")
def calls(results, several):
    """How every exported plot function is called, by its name."""
    trend, repeats, errors, history = several
    predicted, measured = sides(results)
    extent = view(results)
    forces = dict(depth_mm=30.0, P0_N=12.0, bands=results.bands, model_bands=results.model_bands)
    xy = np.stack(np.meshgrid(np.linspace(100, 1900, 5), np.linspace(100, 1100, 4)), axis=-1).reshape(-1, 2)
    grid = np.linspace(0, 1999, 9), np.linspace(0, 1199, 7)
    maps = [figures.PictureMap(*grid, k * np.add.outer(grid[1], grid[0])) for k in (1e-3, 1e-5)]
    camera = (1200, 2000), np.array([300.0, 900.0])
    shear = [ShearMap(np.random.default_rng(k).random((20, 60)), extent, 0.002, 6.0) for k in (1, 2)]
    quality = pd.DataFrame([("standard error", "upper", 0.01)], columns=["quantity", "cell", "value"])
    curve = pd.DataFrame({"u_mm": U, "force_N": 5 + U, "noise_std_N": 0.1, "model_N": 5.1 + U})
    distances = pd.DataFrame(
        [(u, h, 0.1 * u, 0.2) for u in (1.0, 2.0, 5.0) for h in (5.0, 10.0, 15.0, 20.0)],
        columns=["u_mm", "layer", "rms_mm", "validation_std_mm"],
    )
    volume = pd.DataFrame({"u_mm": U[1:], "swept_mm2": 30 * U[1:], "std_mm2": 2.0, "ratio": 1.0})
    softening = figures.SofteningLine(50.0, 32.0, 1.0)
    tests = [figures.History(f"test {k}", 30.0, 12.0, results.force, results.model_force) for k in range(5)]
    metrics = ["First peak, N", "Second outcrop x, mm", "Surface front mean, mm"]
    stages = [figures.Stage(u, predicted, measured) for u in (15.0, 30.0, 40.0)]
    shown = figures.Shown(
        np.zeros((300, 400), np.uint8), points_px=xy / 5, tracked_px=xy / 5, moved_px=np.cos(xy),
        fitted_px=xy / 5, residual_px=0.1 * np.cos(xy), markers_px=xy[:3] / 5, missing_px=xy[5:8] / 5,
        given_px=xy[8:12] / 5, tip_px=np.array([60.0, 180.0]),
    )  # fmt: skip
    place = dict(depth_mm=30.0, extent=extent)
    return {
        "agreement_figure": ((metrics, [0.3, -1.2, 12.0], [(0.2, 0.5, 0.3)] * 3), {}),
        "arm_figure": ((results.force,), dict(depth_mm=30.0)),
        "band_pairs_figure": ((pairs_table(),), {}),
        "bands_figure": ((results.bands, results.increments), dict(model_force=results.model_force)),
        "blade_figure": ((results.blade,), {}),
        "budget_figure": ((results.budget,), {}),
        "cell_calibration_figure": ((cells_table(), quality), {}),
        "distance_map_figure": ((distances,), {}),
        "envelope_figure": ((history,), {}),
        "errors_figure": ((errors,), {}),
        "field_figure": ((results.tracks, 2, 4), dict(extent=extent)),
        "force_figure": ((results.force, results.model_force), dict(**forces, peaks=results.peaks)),
        "forces_figure": ((tests,), {}),
        "kinematics_figure": ((results.increments,), {}),
        "landscape_figure": ((landscape_table(), dict(zip(PARAMETERS, (50, 32, 32), strict=True))), {}),
        "layers_figure": ((predicted, measured), dict(**place, u_mm=40.0)),
        "mobilised_figure": ((results.mobilised, results.mobilised), dict(assumed=softening)),
        "mound_figure": ((mound_table(),), dict(repose_deg=33.0)),
        "noise_figure": (([50, 100, 200], [1, 1.4, 2], [0.1] * 3), dict(gain=0.02, floor=0.0)),
        "power_figure": ((trend,), {}),
        "preview_figure": ((shown,), {}),
        "profiles_figure": ((profiles_table(), {"68 %": 1.0, "95 %": 3.9}), {}),
        "residual_figure": ((xy, 0.1 * np.cos(xy), *camera), {}),
        "scale_figure": ((*maps, xy, *camera), {}),
        "scatter_figure": ((repeats,), {}),
        "shape_figure": ((results.force, results.model_force, (12.0, 12.1)), dict(depth_mm=30.0)),
        "shear_figure": ((tuple(shear),), dict(u_mm=(10.0, 12.0), extent=extent, band=Band(11, 14, 131))),
        "soil_fit_figure": ((curve, np.array([10.0, 20.0])), {}),
        "stages_figure": ((stages,), place),
        "trends_figure": (([trend] * 4,), {}),
        "volume_figure": ((volume,), {}),
    }


@pytest.fixture(params=PLOTS)
def plot(request, calls):
    """Draws one of the exported figures."""
    args, options = calls[request.param]
    return lambda: getattr(figures, request.param)(*args, **options)


@pytest.fixture(scope="module")
def laid_out():
    """Figures that are drawn and have their places, with their texts, by function and width."""
    return {}


@pytest.fixture
def at_width(request, plot, laid_out):
    """A figure of a width, mm (None: the page's), and its texts with their boxes in dots."""
    name = request.node.callspec.params["plot"]

    def drawn(width_mm):
        if (name, width_mm) not in laid_out:
            with nullcontext() if width_mm is None else paper_look(width_mm):
                figure = plot()
                laid_out[name, width_mm] = figure, placed(figure)
        return laid_out[name, width_mm]

    return drawn


def settings():
    """Matplotlib's, but the backend, which is chosen when it is asked for."""
    return {name: mpl.rcParams[name] for name in mpl.rcParams if "backend" not in name}


def axes_of(figure):
    return [one for axes in figure.axes if axes.get_visible() for one in (axes, *axes.child_axes)]


@styled
def placed(figure):
    """Texts that are seen, with their boxes in dots, once everything has its place."""
    figure.draw_without_rendering()
    texts = [*figure.texts]
    for axes in axes_of(figure):
        texts += [axes.title, axes._left_title, axes._right_title, *axes.texts]
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            slack = 1e-9 * (high - low)
            ticks = zip(axis.get_majorticklocs(), axis.get_ticklabels(), strict=False)
            texts += [axis.label, *(label for at, label in ticks if low - slack <= at <= high + slack)]
    for legend in [*figure.legends, *(a.get_legend() for a in axes_of(figure) if a.get_legend())]:
        texts += legend.get_texts()
    boxes = [(t.get_text(), t.get_window_extent()) for t in texts if t.get_visible() and t.get_text().strip()]
    return [(text, box) for text, box in boxes if box.width > 0 and box.height > 0]


def test_a_way_to_call_every_exported_plot_function_is_known(calls):
    assert sorted(calls) == PLOTS


def test_a_figure_comes_back_and_nothing_else_changes(at_width):
    for width_mm in (None, 84.0):
        figure, _ = at_width(width_mm)
        assert isinstance(figure, Figure)


def test_no_plot_function_needs_pyplot():
    words = "import sys; import ploughval.report; print('matplotlib.pyplot' in sys.modules)"
    said = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "False"


def test_every_axis_with_numbers_has_a_unit_or_is_a_known_ratio(at_width):
    figure, _ = at_width(None)
    labels = [axis.label.get_text() for axes in axes_of(figure) for axis in (axes.xaxis, axes.yaxis)]
    labels += [text.get_text() for text in (figure._supxlabel, figure._supylabel) if text is not None]
    labels = [label for label in labels if label]
    assert labels
    for label in labels:
        first = label.splitlines()[0]
        stated = any(unit in f"{first} " or first.endswith(unit) for unit in UNITS)
        assert stated or label in DIMENSIONLESS, label


def test_numbers_stand_at_axes_that_are_labelled_or_titled(at_width):
    figure, _ = at_width(None)
    shared = figure._supxlabel is not None
    for axes in axes_of(figure):
        titled = any(t.get_text() for t in (axes.title, axes._left_title))
        for axis, siblings in (
            (axes.xaxis, axes.get_shared_x_axes()),
            (axes.yaxis, axes.get_shared_y_axes()),
        ):
            ticks = [label.get_text() for label in axis.get_ticklabels() if label.get_visible()]
            numeric = any(text.strip("−-+.%").replace(".", "").isdigit() for text in ticks)
            others = siblings.get_siblings(axes) if axes in figure.axes else [axes]
            named = any(getattr(one, f"{axis.axis_name}axis").label.get_text() for one in others)
            colour_bar = axes.get_label() == "<colorbar>"
            assert not numeric or named or titled or shared or colour_bar, (axis.axis_name, ticks)


@pytest.mark.parametrize("width_mm", WIDTHS_MM)
def test_on_paper_width_and_type_are_as_asked(at_width, width_mm):
    figure, _ = at_width(width_mm)
    assert figure.get_figwidth() * 25.4 == pytest.approx(width_mm, abs=1e-9)
    assert figure.get_figheight() * 25.4 < 240, "taller than the text of a page"
    sizes = {text.get_fontsize() for text in figure.findobj(Text) if text.get_text().strip()}
    assert sizes <= {7.0, 8.0}
    lines = [line for axes in figure.axes for line in axes.lines if line.get_linestyle() != "None"]
    assert min((line.get_linewidth() for line in lines), default=1.0) >= 0.5
    assert figure.get_facecolor() == (1.0, 1.0, 1.0, 1.0)


@pytest.mark.parametrize("width_mm", [None, *WIDTHS_MM])
def test_no_text_is_cut_off_or_lies_on_another(at_width, width_mm):
    figure, texts = at_width(width_mm)
    room = 0.01 * figure.dpi  # a hundredth of an inch: boxes of text are larger than their ink
    for place, (text, box) in enumerate(texts):
        assert box.x0 > -room, text
        assert box.y0 > -room, text
        assert box.x1 < figure.bbox.width + room, text
        assert box.y1 < figure.bbox.height + room, text
        for other, second in texts[:place]:
            across = min(box.x1, second.x1) - max(box.x0, second.x0)
            up = min(box.y1, second.y1) - max(box.y0, second.y0)
            assert across <= room or up <= 2 * room, (text, other)


def test_a_figure_keeps_its_look_when_it_is_drawn_elsewhere(calls):
    args, options = calls["force_figure"]
    with paper_look(84.0):
        figure = figures.force_figure(*args, **options)
    figure.draw_without_rendering()
    axes = figure.axes[0]
    axes.set_xticks(np.linspace(0, 2, 9))  # ticks that are made only now
    figure.draw_without_rendering()
    assert {text.get_fontsize() for text in axes.get_xticklabels()} == {7.0}


def test_the_look_ends_with_its_block():
    names = dict(gain=None, floor=None)
    with paper_look(84.0), paper_look(174.0):
        inner = figures.noise_figure([50, 100], [1, 1.4], [0.1, 0.1], **names)
    after = figures.noise_figure([50, 100], [1, 1.4], [0.1, 0.1], **names)
    assert inner.get_figwidth() * 25.4 == pytest.approx(174.0)
    assert after.get_figwidth() == 6.4


@pytest.mark.parametrize("wrong", [dict(width_mm=20.0), dict(width_mm=84.0, type_pt=2.0)])
def test_sizes_that_cannot_be_drawn_are_refused(wrong):
    with pytest.raises(ConfigError, match="a number from"), paper_look(**wrong):
        pass


def test_legend_columns_are_as_many_as_fit():
    long, short = "increments, measured with their standard deviations", "a"
    assert fitting_columns([short] * 3, 3, 6.4) == 3
    assert fitting_columns([long] * 3, 3, 3.3) == 1
    assert fitting_columns([short], 3, 3.3) == 1


def test_a_heading_that_the_caption_repeats_is_left_to_it(calls):
    args, options = calls["layers_figure"]
    assert figures.layers_figure(*args, **options).get_suptitle()
    with paper_look(84.0):
        assert not figures.layers_figure(*args, **options).get_suptitle()


def test_stages_follow_each_other_with_the_prediction_above(calls):
    args, options = calls["stages_figure"]
    with paper_look(174.0):
        figure = figures.stages_figure(*args, **options)
    titles = [(axes.get_title("left"), axes.get_title("right")) for axes in figure.axes]
    assert [right for _, right in titles] == ["predicted"] * 2 + ["measured"] * 2 + [
        "predicted",
        "",
        "measured",
        "",
    ]
    assert [left for left, _ in titles if left] == [f"u = {u:.1f} mm = {u / 30:.2f} d" for u in (15, 30, 40)]
    assert len({(*axes.get_xlim(), *axes.get_ylim()) for axes in figure.axes}) == 1
    assert [axes.get_visible() for axes in figure.axes] == [True] * 5 + [False, True, False]
