"""Which modules are mutated, and by which tests they are held."""

from typing import NamedTuple

INCLINED = "test_first_force_is_coulombs_for_inclined_blades_sloping_ground_and_surcharge"


class Target(NamedTuple):
    """A module and its tests.

    Attributes
    ----------
    module : str
        Dotted name; its file stands under src/.
    tests : tuple of str
        Test files, or single tests as pytest names them.
    """

    module: str
    tests: tuple[str, ...]


TARGETS = {
    "mechanism": Target(
        "ploughval.model.mechanism",
        (
            "tests/model/test_model_mechanism_bands.py",
            "tests/model/test_model_mechanism.py",
            "tests/model/test_model_incipient.py::test_published_coefficients",
            f"tests/model/test_model_incipient.py::{INCLINED}",
        ),
    ),
    "bending": Target("ploughval.loadcells.bending", ("tests/loadcells/test_bending.py",)),
    "peaks": Target(
        "ploughval.compare.force.peaks",
        (
            "tests/compare/test_peaks.py",
            "tests/compare/test_peaks_uncertainty.py",
            "tests/compare/test_initial_force.py",
        ),
    ),
    "validation": Target("ploughval.compare.validation", ("tests/compare/test_compare_validation.py",)),
}
