"""What compiles the kernels ahead calls those that a run would compile first."""

from ploughval.piv import band_kernel, band_line, kernel
from ploughval.run.warm import warm_correlation, warm_geometry_and_model
from ploughval.tracers import dye_kernel, surface_kernel


def test_correlation_is_compiled_with_its_bands():
    warm_correlation()
    for compiled in (
        kernel.match_points,
        kernel.read_points,
        band_line.divide_points,
        band_kernel.match_bands,
    ):
        assert compiled.signatures


def test_geometry_is_compiled():
    warm_geometry_and_model()
    for compiled in (surface_kernel.likeliest_path, surface_kernel.border_costs, dye_kernel.chains):
        assert compiled.signatures
