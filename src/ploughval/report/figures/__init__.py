"""Plot functions: each returns a Figure and changes nothing else."""

from ploughval.report.figures.agreement import agreement_figure
from ploughval.report.figures.bands import bands_figure
from ploughval.report.figures.budget import budget_figure, by_source
from ploughval.report.figures.calibration import PictureMap, residual_figure, scale_figure
from ploughval.report.figures.cell_calibration import cell_calibration_alt, cell_calibration_figure
from ploughval.report.figures.field import field_figure
from ploughval.report.figures.force import arm_figure, force_figure
from ploughval.report.figures.force_shape import shape_figure
from ploughval.report.figures.kinematics import kinematics_figure
from ploughval.report.figures.layers import Picture, Side, layers_figure
from ploughval.report.figures.noise import noise_figure
from ploughval.report.figures.preview import Shown, preview_figure
from ploughval.report.figures.series import blade_figure, forces_figure
from ploughval.report.figures.shear import shear_figure
from ploughval.report.figures.soil import SofteningLine, mobilised_figure
from ploughval.report.figures.soil_fit import landscape_figure, profiles_figure, soil_fit_figure
from ploughval.report.figures.volume import volume_figure

__all__ = [
    "Picture",
    "PictureMap",
    "Shown",
    "Side",
    "SofteningLine",
    "agreement_figure",
    "arm_figure",
    "bands_figure",
    "blade_figure",
    "budget_figure",
    "by_source",
    "cell_calibration_alt",
    "cell_calibration_figure",
    "field_figure",
    "force_figure",
    "forces_figure",
    "kinematics_figure",
    "landscape_figure",
    "layers_figure",
    "mobilised_figure",
    "noise_figure",
    "preview_figure",
    "profiles_figure",
    "residual_figure",
    "scale_figure",
    "shape_figure",
    "shear_figure",
    "soil_fit_figure",
    "volume_figure",
]
