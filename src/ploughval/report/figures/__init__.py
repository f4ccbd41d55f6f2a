"""Plot functions: each returns a Figure and changes nothing else.

Within :func:`paper_look` they draw for a column or a page of a paper, else for the report page.
"""

from ploughval.report.figures.agreement import agreement_figure
from ploughval.report.figures.band_pairs import band_pairs_figure
from ploughval.report.figures.bands import bands_figure
from ploughval.report.figures.budget import budget_figure, by_source
from ploughval.report.figures.calibration import PictureMap, residual_figure, scale_figure
from ploughval.report.figures.cell_calibration import cell_calibration_alt, cell_calibration_figure
from ploughval.report.figures.differences import distance_map_figure
from ploughval.report.figures.field import field_figure
from ploughval.report.figures.force import arm_figure, force_figure
from ploughval.report.figures.force_shape import shape_figure
from ploughval.report.figures.kinematics import kinematics_figure
from ploughval.report.figures.layers import Picture, Side, layers_figure
from ploughval.report.figures.look import PaperLook, paper_look
from ploughval.report.figures.mound import mound_figure
from ploughval.report.figures.noise import noise_figure
from ploughval.report.figures.preview import Shown, preview_figure
from ploughval.report.figures.series import History, blade_figure, forces_figure
from ploughval.report.figures.several import (
    envelope_figure,
    errors_figure,
    power_figure,
    scatter_figure,
    trends_figure,
)
from ploughval.report.figures.shear import shear_figure
from ploughval.report.figures.soil import SofteningLine, mobilised_figure
from ploughval.report.figures.soil_fit import landscape_figure, profiles_figure, soil_fit_figure
from ploughval.report.figures.stages import Stage, stages_figure
from ploughval.report.figures.volume import volume_figure

__all__ = [
    "History",
    "PaperLook",
    "Picture",
    "PictureMap",
    "Shown",
    "Side",
    "SofteningLine",
    "Stage",
    "agreement_figure",
    "arm_figure",
    "band_pairs_figure",
    "bands_figure",
    "blade_figure",
    "budget_figure",
    "by_source",
    "cell_calibration_alt",
    "cell_calibration_figure",
    "distance_map_figure",
    "envelope_figure",
    "errors_figure",
    "field_figure",
    "force_figure",
    "forces_figure",
    "kinematics_figure",
    "landscape_figure",
    "layers_figure",
    "mobilised_figure",
    "mound_figure",
    "noise_figure",
    "paper_look",
    "power_figure",
    "preview_figure",
    "profiles_figure",
    "residual_figure",
    "scale_figure",
    "scatter_figure",
    "shape_figure",
    "shear_figure",
    "soil_fit_figure",
    "stages_figure",
    "trends_figure",
    "volume_figure",
]
