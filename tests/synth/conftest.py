"""A closed-form stand-in for the model: one band, a flat heap with a slope at rest in front."""

import math
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from ploughval.axes import BAND_COLUMNS


def make_history(depth=30.0, outcrop=90.0, displacement=6.0, du=0.25, repose=32.0):
    slope = math.tan(math.radians(repose))

    def profile(u, rise):
        if u <= 0:
            return np.array([[0.0, depth], [12 * depth, depth]])
        front = u + depth * u / rise  # rise * (front - u) = depth * u: what was pushed away
        crest, toe = front - rise / (2 * slope), front + rise / (2 * slope)
        return np.array([[u, depth + rise], [crest, depth + rise], [toe, depth], [12 * depth, depth]])

    increments, us, rises = [], [0.0], [0.0]
    for u in np.arange(0.0, displacement, du):
        outcrop_y = np.interp(outcrop, *profile(us[-1], rises[-1]).T)
        tangent = outcrop_y / (outcrop - us[-1])
        us.append(u + du)
        rises.append(rises[-1] + du * tangent)
        increments.append(
            SimpleNamespace(
                u_mm=u,
                du_mm=du,
                beta_deg=math.degrees(math.atan(tangent)),
                outcrop_x_mm=outcrop,
                surface=profile(us[-1], rises[-1]),
            )
        )
    return SimpleNamespace(
        increments=increments,
        surface=lambda u: profile(u, np.interp(u, us, rises)),
        force=pd.DataFrame({"u_mm": us[:-1], "force_N": 10 + np.array(us[:-1])}),
        bands=pd.DataFrame([[0, 0, displacement, 18, 0, outcrop, 0, 6]], columns=list(BAND_COLUMNS)),
    )


@pytest.fixture
def toy_history():
    return make_history


@pytest.fixture
def toy_model(monkeypatch):
    """The stand-in in place of the model, so that these tests depend on nothing but this room."""

    def simulate(scene):
        return make_history(scene.blade.depth_mm, displacement=scene.model.displacement_mm)

    monkeypatch.setattr("ploughval.model.simulate", simulate, raising=False)
