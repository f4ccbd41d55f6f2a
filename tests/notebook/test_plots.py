"""Figures of a result and of a simulation: those of the page, one by one, without a trace elsewhere."""

import sys

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from ploughval import load_results, load_scene, simulate
from ploughval.errors import DataError
from ploughval.report import figure_files, write_figures


@pytest.fixture(scope="module")
def result(result_folder):
    return load_results(result_folder)


@pytest.fixture(scope="module")
def simulation(model_settings, tmp_path_factory):
    folder = tmp_path_factory.mktemp("model")
    (folder / "test.toml").write_text(model_settings + "[tracers]\nlayers_mm = [10, 20]\n")
    return simulate(load_scene(folder), displacement_mm=60.0)


@pytest.mark.parametrize(
    "name",
    [
        "force",
        "force_shape",
        "line_of_action",
        "bands",
        "block_motion",
        "agreement",
        "mobilised",
        "budget",
        "blade",
    ],
)
def test_a_figure_of_the_page_comes_by_its_name(result, name):
    assert isinstance(getattr(result.plot, name)(), Figure)


def test_all_figures_have_the_names_under_which_the_command_writes_them(own_folder, tmp_path, monkeypatch):
    monkeypatch.setattr(figure_files, "FIGURED", figure_files.FIGURED[:3])
    written = {path.stem for path in write_figures(own_folder, tmp_path) if path.suffix == ".svg"}
    assert set(load_results(own_folder).plot.all()) == written


def test_drawing_leaves_the_settings_of_matplotlib_alone_and_needs_no_pyplot(result):
    before = dict(mpl.rcParams)
    loaded = "matplotlib.pyplot" in sys.modules
    result.plot.force()._repr_png_()
    assert dict(mpl.rcParams) == before
    assert ("matplotlib.pyplot" in sys.modules) == loaded


def test_the_force_drawn_is_that_of_the_table(result):
    (axes,) = result.plot.force().axes
    lines = {line.get_label(): line for line in axes.lines}
    force = result.force
    x, y = lines["measured"].get_data()
    np.testing.assert_allclose(x, force["u_mm"] / 30.0)
    np.testing.assert_allclose(y, force["force_N"] / 12.3375)  # the model's first peak


def test_layers_are_of_the_photograph_nearest_to_a_displacement_and_else_of_the_last(result):
    titles = [result.plot.layers(u).get_suptitle() for u in (21.0, None)]
    assert titles == ["u = 20.0 mm = 0.67 d", "u = 60.0 mm = 2.00 d"]
    assert isinstance(result.plot.tracks(21.0), Figure)
    assert isinstance(result.plot.shear(21.0), Figure)


def test_a_notebook_shows_a_figure_at_its_size(result):
    figure = result.plot.bands()
    data, shown = figure._repr_png_()
    assert data.startswith(b"\x89PNG")
    assert shown["width"] == pytest.approx(100 * figure.get_figwidth())
    width = int.from_bytes(data[16:20], "big")
    assert width == round(150 * figure.get_figwidth())


def test_a_figure_without_results_is_refused_in_words(result):
    with pytest.raises(DataError, match="no figure 'mound': the test has no results for it"):
        result.plot.mound()
    with pytest.raises(DataError, match=r"no figure 'agreement-layers'.*there are: agreement-force"):
        result.plot.agreement("layers")


def test_a_simulation_has_units_and_is_a_history_still(simulation):
    assert simulation.force.attrs["units"]["force_N"] == "N"
    assert simulation.bands.attrs["units"]["beta_deg"] == "degree"
    assert simulation.surface(10.0)[0, 0] == pytest.approx(10.0)
    assert repr(simulation).startswith("<Simulation of model only: 2 shear bands to u = 60 mm, P0 = 54.35 N;")


def test_its_dataset_holds_the_force_with_what_belongs_to_it(simulation):
    dataset = simulation.to_dataset()
    np.testing.assert_array_equal(dataset["force_N"], simulation.force["force_N"])
    assert dataset["outcrop_x_mm"].attrs["units"] == "mm"
    assert dataset.attrs["P0_N"] == simulation.P0_N


def test_its_figures_show_the_force_that_load_cells_measure(model_settings, tmp_path):
    rough = model_settings.replace("residual_friction_deg", "wall_friction_deg = 20.0\nresidual_friction_deg")
    (tmp_path / "test.toml").write_text(rough)
    run = simulate(load_scene(tmp_path), displacement_mm=20.0)
    (line,) = (one for one in run.plot.force().axes[0].lines if one.get_label() == "predicted")
    ratio = line.get_ydata()[5:] / line.get_ydata()[0]
    np.testing.assert_allclose(ratio, run.force["force_N"][5:] / run.force["force_N"].iloc[0])
    top = run.plot._results().model_force["force_N"]
    np.testing.assert_allclose(top, run.force["force_N"] * np.cos(np.radians(20.0)))


def test_its_surface_is_drawn_without_layers(model_settings, tmp_path):
    (tmp_path / "test.toml").write_text(model_settings)
    run = simulate(load_scene(tmp_path), displacement_mm=6.0)
    figure = run.plot.layers(3.0)
    assert figure.get_suptitle() == "u = 3.0 mm = 0.10 d"
    drawn = [line.get_xydata() for axes in figure.axes for line in axes.lines]
    surface = run.surface(3.0)
    assert any(len(points) == len(surface) and np.allclose(points, surface) for points in drawn)


def test_its_layers_are_drawn_at_any_displacement_that_it_reaches(simulation):
    assert simulation.plot.layers(12.5).get_suptitle() == "u = 12.5 mm = 0.42 d"
    assert simulation.plot.layers().get_suptitle() == "u = 60.0 mm = 2.00 d"
    assert isinstance(simulation.plot.bands(), Figure)
    with pytest.raises(DataError, match="outside the model run"):
        simulation.plot.layers(500.0)
