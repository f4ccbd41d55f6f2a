"""Augmented-Lagrangian image correlation of al-dic, with and without its global step."""

import numpy as np
from adaptor import MARGIN, STEP, SUBSET, Found, Measure, Picture, finite
from al_dic import dicpara_default, run_aldic
from al_dic.core.data_structures import GridxyROIRange


def measure_with(global_step: bool) -> Measure:
    """Measure with the package's defaults but for the subset, the step and the global step."""

    def measure(reference: Picture, current: Picture) -> Found:
        height, width = reference.shape
        settings = dicpara_default(
            winsize=SUBSET - 1, winstepsize=STEP, img_size=(height, width), use_global_step=global_step,
            gridxy_roi_range=GridxyROIRange((MARGIN, width - 1 - MARGIN), (MARGIN, height - 1 - MARGIN)),
        )  # fmt: skip
        pictures = [picture / 255.0 for picture in (reference, current)]
        masks = [np.ones(reference.shape)] * 2
        result = run_aldic(settings, pictures, masks, compute_strain=False)
        return finite(result.dic_mesh.coordinates_fem, result.result_disp[0].U.reshape(-1, 2))

    return measure
