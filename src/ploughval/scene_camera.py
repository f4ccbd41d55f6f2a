"""The table of the photographs in test.toml: files, times, geometry."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from ploughval.axes import Direction
from ploughval.errors import Fault
from ploughval.limits import MM_PER_PX
from ploughval.scene_base import Count, Finite, NotNegative, Pixel, Positive, Table, Whole


class Interval(Table):
    """Times of photographs taken at a constant interval."""

    start_s: Finite = Field(description="time of the first photograph, s")
    interval_s: Positive = Field(description="time between two photographs, s")


class Board(Table):
    """A calibration board photographed in the window plane."""

    kind: Literal["charuco", "chessboard", "dots"] = Field(description="pattern of the board")
    picture: str = Field(description="photograph of the board, relative to the test folder")
    columns: Count = Field(description="squares (charuco), inner corners or dots in a row")
    rows: Count = Field(description="squares (charuco), inner corners or dots in a column")
    spacing_mm: Positive = Field(description="side of a square or distance of dots, mm")
    marker_mm: Positive | None = Field(None, description="side of a ChArUco marker, mm")
    dictionary: str = Field("DICT_4X4_50", description="OpenCV's name of the ChArUco dictionary")


class Window(Table):
    """[camera.window]: the pane between camera and sand, for the refraction in it."""

    thickness_mm: Annotated[Positive, Field(le=1e3)] = Field(description="thickness of the window, mm")
    index: float = Field(
        1.49, ge=1.0, le=3.0, allow_inf_nan=False, strict=True, description="refractive index; acrylic: 1.49"
    )
    distance_mm: Annotated[Positive, Field(ge=1, le=1e6)] = Field(
        description="camera's lens to the outer face of the window, mm"
    )
    thickness_std_mm: NotNegative = Field(0.0, description="standard uncertainty of the thickness, mm")
    index_std: NotNegative = Field(0.0, description="standard uncertainty of the refractive index")
    distance_std_mm: NotNegative = Field(0.0, description="standard uncertainty of the distance, mm")
    points_on: Literal["outside", "inside"] = Field(
        description="face of the window on which scale, control points or board lie"
    )
    foot_px: Pixel | None = Field(
        None, description="where the lens sees itself mirrored in the window, px; absent: from the tilt"
    )


class Markers(Table):
    """[camera.markers]: dots or circles painted on the window, found in the picture and in every frame."""

    radius_px: Annotated[Positive, Field(ge=2, le=1e4)] = Field(description="radius of the dots, about, px")
    kind: Literal["dot", "ring"] = Field("dot", description="filled dots, or drawn circles")
    reach_px: Positive | None = Field(
        None, description="farthest that a marker is from its approximate place, px; absent: two radii"
    )
    disc_px: Positive | None = Field(
        None,
        description="radius of what is painted about a dot, px: no sand is seen there; absent: two radii",
    )
    fixed_px: tuple[Pixel, ...] = Field(
        (), max_length=1000, description="[px_x, px_y] each, about: markers besides the control points"
    )

    @property
    def clear_px(self) -> float:
        """Radius about a marker in which no sand is seen, px."""
        return 2 * self.radius_px if self.disc_px is None else self.disc_px


def _fixed_px(markers: object) -> Any:
    """Places of markers in raw values or in a validated table; None: not a list."""
    fixed = markers.get("fixed_px", ()) if isinstance(markers, Mapping) else getattr(markers, "fixed_px", ())
    return fixed if isinstance(fixed, list | tuple) else None


EQUIPMENT = (
    "make",
    "model",
    "lens",
    "focal_mm",
    "aperture",
    "exposure_s",
    "iso",
    "stand_off_mm",
    "lighting",
    "pattern",
    "note",
)
"""Keys of [camera] that only tell what was used: no number of a result depends on them."""

Words = Annotated[str, Field(max_length=500, strict=True)]


class Camera(Table):
    """[camera]: the photographs, their times and their geometry."""

    photos: str = Field(description="pattern of the photographs, relative to the test folder")
    times: Literal["exif", "video"] | str | Interval | None = Field(
        None,
        description='CSV (file,time_s), "exif", "video" (as a video or GIF says), {start_s, interval_s}, or '
        "absent: times unknown",
    )
    every: int = Field(
        1, ge=1, le=100_000, strict=True, description="each Nth picture is used, from the first"
    )
    mm_per_px: Annotated[Positive, Field(le=MM_PER_PX)] | None = Field(
        None, description="scale, mm per px, with tip_px and direction"
    )
    mm_per_px_std: NotNegative = Field(0.0, description="standard uncertainty of the scale, mm per px")
    tip_px: Pixel | None = Field(None, description="blade face at tip level before the blade moves, px")
    travel_px: Pixel | None = Field(
        None, description="with board: where the tip stands later, px; absent: travel along the rows"
    )
    direction: Direction = Field(Direction.RIGHT, description="the way the blade travels in the photograph")
    control_points: (
        Annotated[tuple[tuple[Finite, Finite, Finite, Finite], ...], Field(max_length=10_000)] | None
    ) = Field(None, description="[px_x, px_y, x_mm, y_mm] each, at least 4")
    markers: Markers | None = Field(
        None,
        description="painted markers: control_points are then approximate; told of the camera's movement",
    )
    board: Board | None = Field(None, description="board in the window plane, with tip_px and direction")
    calibration: str | None = Field(
        None, description="calibration.json of a test of the same set-up; tip_px then moves its origin"
    )
    points_std_px: Positive | None = Field(
        None,
        description="standard uncertainty of a point in the photograph, px; absent: from the residuals",
    )
    points_std_mm: NotNegative = Field(
        0.0, description="standard uncertainty of a control point's place on the window, mm"
    )
    window: Window | None = Field(None, description="the pane between camera and sand, for its refraction")
    clock_offset_s: Finite | Literal["auto"] = Field(0.0, description="photograph clock minus log clock, s")
    channel: Literal["grey", "red", "green", "blue"] = Field("grey", description="what is correlated")
    view_px: tuple[Whole, Whole, Whole, Whole] | None = Field(
        None, description="[x0, y0, x1, y1] part of the photograph that shows the test, px"
    )
    make: Words = Field("", description="maker of the camera; absent: by EXIF, like all down to iso")
    model: Words = Field("", description="model of the camera")
    lens: Words = Field("", description="lens")
    focal_mm: Positive | None = Field(None, description="focal length, mm")
    aperture: Positive | None = Field(None, description="f-number of the aperture: 8.0 for f/8")
    exposure_s: Positive | None = Field(None, description="time of exposure, s")
    iso: Positive | None = Field(None, description="sensitivity, ISO speed")
    stand_off_mm: Positive | None = Field(None, description="camera's lens to the window, mm")
    lighting: Words = Field("", description="lamps and where they stand")
    pattern: Words = Field("", description="what the sand's texture is: natural, seeded with dyed grains")
    note: Words = Field("", description="anything else of the camera that is worth keeping")

    @property
    def marker_places_px(self) -> tuple[Pixel, ...]:
        """Approximate places of all painted markers, px: control points, then the others."""
        if self.markers is None:
            return ()
        return (*((x, y) for x, y, *_ in self.control_points or ()), *self.markers.fixed_px)

    @property
    def times_file(self) -> str | None:
        """Name of the CSV table of times; None where the times come from elsewhere."""
        return self.times if isinstance(self.times, str) and self.times not in ("exif", "video") else None

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> list[Fault]:
        """No calibration or two of them; a scale or board without tip; too few control points."""
        ways = ("mm_per_px", "control_points", "board", "calibration")
        given = [k for k in ways if values.get(k) is not None]
        faults = []
        if len(given) != 1:
            got = " and ".join(given) or "none"
            faults.append(
                Fault("", got, f"exactly one of {', '.join(ways)}", "It calibrates the photographs.")
            )
        if values.get("tip_px") is None and given and not {"control_points", "calibration"} & set(given):
            faults.append(Fault("tip_px", "nothing", f"a value with {given[0]}", cls._text("tip_px")))
        points = values.get("control_points")
        if isinstance(points, list | tuple) and len(points) < 4:
            faults.append(Fault("control_points", f"{len(points)} points", "at least 4"))
        told = values.get("points_std_px") is not None or values.get("markers") is not None
        if values.get("points_std_mm") and not told:
            faults.append(
                Fault("points_std_px", "nothing", "a value with points_std_mm", cls._text("points_std_px"))
            )
        if values.get("travel_px") is not None:
            faults += cls._travel_faults(values)
        if values.get("markers") is not None and points is None:
            fixed = _fixed_px(values["markers"])
            if fixed is not None and len(fixed) < 3:
                expected = "control_points, or at least 3 markers"
                faults.append(
                    Fault("markers.fixed_px", f"{len(fixed)} markers", expected, "Name their places.")
                )
        return faults

    @classmethod
    def _travel_faults(cls, values: Mapping[str, Any]) -> list[Fault]:
        """A line of travel that nothing asks for, or that runs against the direction."""
        travel, tip = values["travel_px"], values.get("tip_px")
        if values.get("board") is None:
            return [Fault("travel_px", repr(travel), "none without board", "Take it out.")]
        try:
            along = float(travel[0]) - float(tip[0])  # type: ignore[index]
            sign = Direction(values.get("direction", Direction.RIGHT)).sign
        except (TypeError, ValueError, IndexError):
            return []  # told by the types
        if along * sign <= 0:
            way = "right" if sign > 0 else "left"
            expected = f"a place to the {way} of tip_px, as direction says"
            return [
                Fault("travel_px", repr(travel), expected, "Read the tip's place off a later photograph.")
            ]
        return []

    @classmethod
    def _text(cls, key: str) -> str:
        return f"Add {key}: {cls.model_fields[key].description}."
