"""The least that a test.toml may hold: a scene for the model alone."""

import pytest

MODEL_ONLY = """
[test]
name = "model only"
[blade]
depth_mm = 30.0
width_mm = 1000.0
[soil]
unit_weight_kN_m3 = 16.0
peak_friction_deg = 50.0
residual_friction_deg = 32.0
"""


@pytest.fixture(scope="session")
def model_settings():
    """Its text, to which tables may be added."""
    return MODEL_ONLY


@pytest.fixture
def model_only(tmp_path, model_settings):
    """A test folder with it, and two layers."""
    (tmp_path / "test.toml").write_text(model_settings + "[tracers]\nlayers_mm = [10, 20]\n")
    return tmp_path
