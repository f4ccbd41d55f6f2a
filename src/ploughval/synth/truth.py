"""The exact truth of a synthetic test: written beside it, read without the model."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from ploughval.axes import BAND_COLUMNS, LAYER_COLUMNS, SURFACE_COLUMNS, Direction
from ploughval.errors import DataError
from ploughval.scene import Soil
from ploughval.synth.motion import Floats, Motion, Trench
from ploughval.synth.options import SynthOptions


@dataclass(frozen=True, slots=True)
class Truth:
    """What a synthetic test really did.

    Attributes
    ----------
    options : SynthOptions
    tip_px : (float, float), px, as stated in test.toml
    motion : Motion
        Every step of the sand.
    force : DataFrame of time_s, u_mm, force_N, arm_mm
        The sand's force on the blade, row for row of the log.
    bands : DataFrame of BAND_COLUMNS
    surface : DataFrame of SURFACE_COLUMNS
        Ahead of the blade, one polyline a frame.
    layers : DataFrame of LAYER_COLUMNS
        Source "truth"; a row of NaN x, y where the material line is torn.
    blade : DataFrame of frame, time_s (of the log's clock), u_mm, x_px (blade face)
    """

    options: SynthOptions
    tip_px: tuple[float, float]
    motion: Motion
    force: pd.DataFrame
    bands: pd.DataFrame
    surface: pd.DataFrame
    layers: pd.DataFrame
    blade: pd.DataFrame

    def positions(self, points_mm: ArrayLike) -> Floats:
        """Material points, (N, 2) mm before motion, in all photographs: (F, N, 2) mm.

        NaN from the first photograph after a point avalanched, was swept up by the blade or buried behind it.
        """
        return self.motion.positions(np.asarray(points_mm, dtype=np.float64))


def surface_table(motion: Motion, frames_u_mm: Floats) -> pd.DataFrame:
    """Free surface ahead of the blade in every photograph."""
    rows = [
        np.column_stack([np.full((len(line), 2), (frame, u)), line])
        for frame, u in enumerate(frames_u_mm)
        for line in [motion.surfaces[motion.frame_steps[frame]]]
    ]
    return _with_frames(pd.DataFrame(np.vstack(rows), columns=list(SURFACE_COLUMNS)))


def layer_table(motion: Motion, frames_u_mm: Floats, heights_mm: Floats, x_mm: Floats) -> pd.DataFrame:
    """Material lines in every photograph; lines of NaN are thinned to one row a tear."""
    if not len(heights_mm):
        return pd.DataFrame(columns=list(LAYER_COLUMNS))
    count = len(x_mm)
    start = np.column_stack([np.tile(x_mm, len(heights_mm)), np.repeat(heights_mm, count)])
    places = motion.positions(start)
    table = pd.DataFrame(
        {
            "frame": np.repeat(np.arange(len(frames_u_mm)), len(start)),
            "u_mm": np.repeat(frames_u_mm, len(start)),
            "layer": np.tile(start[:, 1], len(frames_u_mm)),
            "source": "truth",
            "x_mm": places[..., 0].ravel().round(3),
            "y_mm": places[..., 1].ravel().round(3),
            "std_mm": 0.0,
        }
    )
    torn = table["x_mm"].isna()
    again = torn & torn.shift(fill_value=False) & (table["layer"] == table["layer"].shift())
    return table[~again].reset_index(drop=True)


def write_truth(folder: Path, truth: Truth) -> None:
    """Write a folder ``truth``: truth.json, motions.npz and the tables as CSV."""
    folder.mkdir(parents=True, exist_ok=True)
    options = asdict(truth.options)
    for key in ("soil", "told_soil"):
        options[key] = None if options[key] is None else options[key].model_dump()
    text = json.dumps({"options": options, "tip_px": truth.tip_px}, indent=1)
    (folder / "truth.json").write_text(text + "\n", encoding="utf-8")
    motion = truth.motion
    np.savez_compressed(
        folder / "motions.npz",
        u_mm=motion.u_mm,
        du_mm=motion.du_mm,
        beta_deg=motion.beta_deg,
        outcrop_x_mm=motion.outcrop_x_mm,
        nodes_mm=np.vstack(motion.surfaces),
        node_counts=np.array([len(s) for s in motion.surfaces]),
        frame_steps=motion.frame_steps,
        trench=np.array([motion.trench.depth_mm, motion.trench.thickness_mm, motion.trench.repose_deg]),
        rounding_mm=motion.rounding_mm,
    )
    for name in _TABLES:
        getattr(truth, name).to_csv(folder / f"{name}.csv", index=False, lineterminator="\n")


_TABLES = ("force", "bands", "surface", "layers", "blade")


def load_truth(folder: Path | str) -> Truth:
    """Read the truth of a synthetic test folder.

    Parameters
    ----------
    folder : path-like
        The test folder, or its folder ``truth``.

    Returns
    -------
    Truth
        What was drawn, exactly.

    Raises
    ------
    DataError
        Where there is no truth, or one that cannot be read.
    """
    folder = Path(folder)
    folder = folder / "truth" if (folder / "truth").is_dir() else folder
    try:
        stated = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
        options = _options_from(stated["options"])
        motion = _read_motion(folder / "motions.npz")
        tables = {name: pd.read_csv(folder / f"{name}.csv") for name in _TABLES}
    except (OSError, ValueError, KeyError, TypeError) as error:
        text = f"no truth of a synthetic test can be read here ({error}); make one with: ploughval synth"
        raise DataError(text, path=folder) from error
    return Truth(options, tuple(stated["tip_px"]), motion, **tables)


def _options_from(stated: dict[str, Any]) -> SynthOptions:
    soils = {k: None if stated[k] is None else Soil(**stated[k]) for k in ("soil", "told_soil")}
    lists = {k: tuple(v) for k, v in stated.items() if isinstance(v, list)}
    return SynthOptions(**{**stated, **lists, **soils, "direction": Direction(stated["direction"])})


def _read_motion(path: Path) -> Motion:
    with np.load(path, allow_pickle=False) as data:
        surfaces = tuple(np.split(data["nodes_mm"], np.cumsum(data["node_counts"])[:-1]))
        depth, thickness, repose = (float(v) for v in data["trench"])
        return Motion(
            data["u_mm"],
            data["du_mm"],
            data["beta_deg"],
            data["outcrop_x_mm"],
            surfaces,
            data["frame_steps"],
            Trench(depth, thickness, repose),
            float(data["rounding_mm"]),
        )


def _with_frames(table: pd.DataFrame) -> pd.DataFrame:
    return table.astype({"frame": np.int64})


def band_table(bands: pd.DataFrame) -> pd.DataFrame:
    """The model's bands with the columns and order of bands.csv."""
    return bands.loc[:, list(BAND_COLUMNS)].reset_index(drop=True)
