"""calibration.json: a calibration as a file that another test of the same set-up can use again."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pydantic import BaseModel, ConfigDict, ValidationError

from ploughval.axes import Direction
from ploughval.errors import CalibrationError, DataError
from ploughval.limits import PICTURE_SIDE_PX, SETTINGS_BYTES, read_limited
from ploughval.photos.calibration.camera_fit import TermTest
from ploughval.photos.calibration.camera_model import PARAMETERS, CameraModel
from ploughval.photos.calibration.lens import TERMS, Lens
from ploughval.photos.calibration.mapping import POINT_COLUMNS, Calibration
from ploughval.scene import Window

VERSION = 1
_REMEDY = "Write it anew with: ploughval process"

Row3 = tuple[float, float, float]


class _File(BaseModel):
    """What the file holds; numbers keep every bit."""

    model_config = ConfigDict(extra="forbid", strict=False, allow_inf_nan=False, frozen=True)

    version: int
    photograph_px: tuple[int, int]  # width, height
    direction: Direction
    method: str
    mm_per_px: float
    scale_relative_std: float
    residual_px: float
    point_std_px: float | None
    px_from_face: tuple[Row3, Row3, Row3]
    lens: dict[str, float]
    window: Window | None
    spread: tuple[tuple[float, ...], ...]
    points: tuple[tuple[float, float, float, float, float, float], ...]
    lens_tests: tuple[tuple[tuple[str, ...], float, bool], ...]


def calibration_record(found: Calibration) -> dict[str, Any]:
    """A calibration as the contents of calibration.json: numbers, texts and lists only.

    Keys: version, photograph_px (width, height), direction, method, mm_per_px, scale_relative_std,
    residual_px, point_std_px, px_from_face (3 x 3), lens (k1 to p2), window, spread (16 rows), points
    (px_x, px_y, x_mm, y_mm and residuals), lens_tests (terms, p value, taken).
    """
    model = found.model
    return {
        "version": VERSION,
        "photograph_px": [found.shape[1], found.shape[0]],
        "direction": found.direction.value,
        "method": found.method,
        "mm_per_px": found.mm_per_px,
        "scale_relative_std": found.scale_std,
        "residual_px": found.residual_px,
        "point_std_px": found.std_px if np.isfinite(found.std_px) else None,
        "px_from_face": model.px_from_face.tolist(),
        "lens": dict(zip(TERMS, model.lens.terms.tolist(), strict=True)),
        "window": None if model.window is None else model.window.model_dump(mode="json"),
        "spread": found.spread.tolist(),
        "points": found.points[list(POINT_COLUMNS)].to_numpy(float).tolist(),
        "lens_tests": [[list(t.terms), t.p_value, t.taken] for t in found.tests],
    }


def read_calibration(path: Path, shape: tuple[int, int] | None = None) -> Calibration:
    """Read calibration.json, for photographs of (H, W) px or for those that it was made for.

    Raises
    ------
    DataError
        A file that cannot be read or is not one of these.
    CalibrationError
        Photographs of another size.
    """
    held = _read(path)
    made_for = held.photograph_px[::-1]
    shape = made_for if shape is None else shape
    if made_for != shape:
        raise CalibrationError(
            f"{path}: for photographs of {held.photograph_px[0]} x {held.photograph_px[1]} px; got "
            f"{shape[1]} x {shape[0]} px. Use the calibration of a test of the same set-up"
        )
    terms = np.array([held.lens[name] for name in TERMS])
    model = CameraModel.of(np.array(held.px_from_face), Lens.of_picture(shape, terms), held.window)
    return Calibration(
        model=model,
        mm_per_px=held.mm_per_px,
        scale_std=held.scale_relative_std,
        residual_px=held.residual_px,
        points=pd.DataFrame(np.array(held.points, float).reshape(-1, 6), columns=list(POINT_COLUMNS)),
        method=held.method,
        direction=held.direction,
        spread=np.array(held.spread, float).reshape(PARAMETERS, -1),
        std_px=np.nan if held.point_std_px is None else held.point_std_px,
        shape=shape,
        tests=tuple(TermTest(*test) for test in held.lens_tests),
    )


def _read(path: Path) -> _File:
    try:
        values = json.loads(read_limited(path, SETTINGS_BYTES, _REMEDY).decode("utf-8"))
        version = values.get("version") if isinstance(values, dict) else None
        if version != VERSION:
            raise DataError(f"version: got {version!r}; expected {VERSION}. {_REMEDY}", path=path)
        held = _File.model_validate(values)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        raise DataError(
            f"{place}: got {repr(first['input'])[:80]}; {first['msg']}. {_REMEDY}", path=path
        ) from None
    except (OSError, ValueError, RecursionError) as error:
        raise DataError(f"not readable as JSON: {error}. {_REMEDY}", path=path) from None
    if not all(1 <= side <= PICTURE_SIDE_PX for side in held.photograph_px):
        raise DataError(
            f"photograph_px: got {' x '.join(str(side)[:20] for side in held.photograph_px)}; expected 1 to "
            f"{PICTURE_SIDE_PX} px a side. {_REMEDY}",
            path=path,
        )
    if set(held.lens) != set(TERMS):
        raise DataError(f"lens: got {sorted(held.lens)}; expected {list(TERMS)}. {_REMEDY}", path=path)
    if len(held.spread) != PARAMETERS or len({len(row) for row in held.spread}) != 1:
        raise DataError(
            f"spread: got {len(held.spread)} rows; expected {PARAMETERS} of one length. {_REMEDY}", path=path
        )
    if not abs(np.linalg.det(np.array(held.px_from_face))) > 0 or held.px_from_face[2][2] != 1:
        raise DataError(f"px_from_face: not a homography whose last entry is 1. {_REMEDY}", path=path)
    return held
