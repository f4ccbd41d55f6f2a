"""The model's force on the page is what load cells measure: the horizontal part of P."""

import json

import numpy as np
import pandas as pd
import pytest

from ploughval.results import read_results


@pytest.mark.parametrize(("wall", "lean"), [(0.0, 0.0), (12.0, 0.0), (12.0, -30.0), (5.0, 10.0)])
def test_wall_friction_and_the_lean_of_the_face_incline_the_models_force(own_folder, wall, lean):
    path = own_folder / "run.json"
    record = json.loads(path.read_text(encoding="utf-8"))
    record["settings"]["soil"] = {**record["settings"].get("soil", {}), "wall_friction_deg": wall}
    record["settings"]["blade"] = {**record["settings"].get("blade", {}), "inclination_deg": lean}
    path.write_text(json.dumps(record), encoding="utf-8")
    shown = read_results(own_folder).model_force
    written = pd.read_csv(own_folder / "model" / "force.csv")["force_N"]
    np.testing.assert_allclose(shown["force_N"], written * np.cos(np.radians(wall + lean)), rtol=1e-12)
