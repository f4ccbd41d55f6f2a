"""The tables of test.toml: keys with unit, range and meaning, and what contradicts itself within a table."""

import math
from collections import Counter
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from ploughval.errors import Fault
from ploughval.scene_base import Angle, Finite, Flag, Length, NotNegative, Pixel, Positive, Table
from ploughval.scene_faults import number


class TestTable(Table):
    """[test]: what the test is called."""

    __test__ = False
    name: str = Field(min_length=1, max_length=200, description="name of the test, plain text")
    notes: str = Field("", max_length=20_000, description="anything worth keeping, plain text")


class Blade(Table):
    """[blade]: the plough."""

    depth_mm: Length = Field(description="depth of the tip below the initial surface, mm")
    width_mm: Length = Field(description="width out of plane, mm; force_N is for this width")
    thickness_mm: Length = Field(5.0, description="thickness in the direction of travel, mm")
    speed_mm_s: Positive | None = Field(None, description="speed of travel, mm/s: the log is held against it")
    depth_std_mm: NotNegative = Field(0.0, description="standard uncertainty of the depth, mm")
    inclination_deg: Annotated[Finite, Field(ge=-60, le=60)] = Field(
        0.0, description="of the face to the vertical, degrees; positive: its top leans ahead, over the sand"
    )


class Box(Table):
    """[box]: the strongbox."""

    length_mm: Annotated[Positive, Field(le=1e5)] | None = Field(
        None, description="inner length along the travel, mm; absent: the sand has no end"
    )


class Soil(Table):
    """[soil]: the sand, with the standard uncertainties that the validation carries."""

    unit_weight_kN_m3: Annotated[Positive, Field(le=100, description="unit weight, kN/m3")]
    peak_friction_deg: Angle = Field(description="peak friction angle, degrees")
    residual_friction_deg: Angle = Field(description="residual friction angle, degrees")
    mobilization_length_mm: NotNegative = Field(1.0, description="slip from peak to residual, mm")
    wall_friction_deg: Annotated[NotNegative, Field(lt=90)] = Field(
        0.0, description="blade-sand friction angle, degrees"
    )
    repose_deg: Angle | None = Field(
        None,
        description="slope at which the surface avalanches, degrees; absent: the residual friction angle",
    )
    surcharge_kPa: NotNegative = Field(0.0, description="load on the surface, kPa of horizontal area")
    unit_weight_std_kN_m3: NotNegative = Field(0.0, description="standard uncertainty, kN/m3")
    peak_friction_std_deg: NotNegative = Field(0.0, description="standard uncertainty, degrees")
    residual_friction_std_deg: NotNegative = Field(0.0, description="standard uncertainty, degrees")
    mobilization_length_std_mm: NotNegative = Field(0.0, description="standard uncertainty, mm")
    wall_friction_std_deg: NotNegative = Field(0.0, description="standard uncertainty, degrees")

    @property
    def slope_of_repose_deg(self) -> float:
        """Angle at which the surface avalanches: repose_deg, or the residual friction angle, degrees."""
        return self.residual_friction_deg if self.repose_deg is None else self.repose_deg

    @property
    def horizontal_share(self) -> float:
        """Horizontal part of the blade's force P, which wall friction inclines: cos of the angle.

        The model's force is P; load cells measure P times this.
        """
        return math.cos(math.radians(self.wall_friction_deg))

    @property
    def softens(self) -> bool:
        """Whether the friction angle falls with slip at all."""
        return self.peak_friction_deg > self.residual_friction_deg

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> list[Fault]:
        """Residual above peak; peak and wall friction that leave no mechanism."""
        peak, residual = (number(values, f"{k}_friction_deg") for k in ("peak", "residual"))
        wall = number(values, "wall_friction_deg", 0.0)
        faults = []
        if peak is not None and residual is not None and residual > peak > 0:
            expected = f"at most peak_friction_deg, {peak:g}"
            faults.append(Fault("residual_friction_deg", f"{residual:g}", expected))
        if peak is not None and wall is not None and 0 < peak < 90 <= peak + wall < 180:
            expected = f"less than {90 - peak:g}, which is 90 - peak_friction_deg"
            faults.append(Fault("wall_friction_deg", f"{wall:g}", expected))
        return faults


class Tracers(Table):
    """[tracers]: material lines to follow."""

    layers_mm: tuple[Finite, ...] = Field(max_length=1000, description="initial heights above the tip, mm")
    dyed: Flag | tuple[Flag, ...] = Field(
        False, description="whether the layers are dyed sand, for all or each"
    )
    dye: Literal["dark", "pale"] = Field(
        "dark", description="dyed sand against the rest, for the reader: the first photograph shows which"
    )
    thickness_mm: Positive | None = Field(None, description="thickness of a dyed layer, mm; absent: 2")

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> list[Fault]:
        """As many flags as layers; no layer twice."""
        layers, dyed = values.get("layers_mm"), values.get("dyed", False)
        if not isinstance(layers, list | tuple):
            return []
        faults = []
        if isinstance(dyed, list | tuple) and len(dyed) != len(layers):
            faults.append(
                Fault("dyed", f"{len(dyed)} values", f"one for each of {len(layers)} layers, or one")
            )
        heights = Counter(h for h in layers if isinstance(h, int | float))
        twice = sorted(h for h, count in heights.items() if count > 1)
        if twice:
            faults.append(Fault("layers_mm", f"{', '.join(map(str, twice))} twice", "each height once"))
        return faults

    @property
    def dyed_layers_mm(self) -> tuple[float, ...]:
        """Heights of those layers that are dyed sand, mm."""
        flags = [self.dyed] * len(self.layers_mm) if isinstance(self.dyed, bool) else self.dyed
        return tuple(h for h, dyed in zip(self.layers_mm, flags, strict=True) if dyed)


class Piv(Table):
    """[piv]: subset correlation."""

    track: Flag = Field(True, description="false: texture too poor to track points; layers only where dyed")
    subset_px: Annotated[int, Field(ge=9, le=201, strict=True)] = Field(
        31, description="side of a subset, px (odd)"
    )
    spacing_px: Annotated[Positive, Field(ge=2, le=1000)] | None = Field(
        None, description="distance of points, px; absent: half a subset"
    )
    order: Literal[0, 1, 2] = Field(1, description="order of the shape function")
    spline: Literal[3, 5] = Field(5, description="order of the interpolating B-spline")
    zncc_min: Annotated[NotNegative, Field(le=1)] = Field(
        0.7, description="least correlation of a valid vector"
    )
    noise_grey: NotNegative | None = Field(
        None, description="grey-level noise of one photograph; absent: estimated"
    )


class Bands(Table):
    """[bands]: the shear-band finder."""

    min_slip_mm: NotNegative | None = Field(
        None, description="least slip of a band that is reported, mm; absent: 1 % of the depth"
    )


class ModelTable(Table):
    """[model]: the incremental-collapse model."""

    run: Flag = Field(True, description="false: no model for this test")
    displacement_mm: Positive | None = Field(
        None, description="blade travel; absent: the test's own, or 3 depths"
    )
    tolerance: Annotated[Positive, Field(ge=1e-6, le=0.1)] = Field(
        1e-3, description="relative numerical error aimed at"
    )
    outcrop: Literal["stationary", "riding"] = Field("stationary", description="rule for the band's outcrop")
    direction: Literal["least_force", "least_softened"] = Field(
        "least_force", description="a fresh band's direction: cheapest at peak friction, or once softened"
    )
    mechanism: Literal["one_block", "two_blocks"] = Field(
        "one_block", description="most blocks on a band; two: on a bent band beside a rough blade, if cheaper"
    )
    initial_surface_mm: Annotated[tuple[Pixel, ...], Field(max_length=100_000)] | None = Field(
        None, description="[x, y] of the initial surface ahead of the blade, mm; absent: flat"
    )

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> list[Fault]:
        """Two blocks, whose bands are sought by least force, with another rule of direction."""
        if values.get("mechanism") != "two_blocks" or values.get("direction") != "least_softened":
            return []
        return [Fault("direction", "'least_softened'", "'least_force' with mechanism = 'two_blocks'")]


class Compare(Table):
    """[compare]: peaks and matching."""

    prominence: Positive | None = Field(
        None,
        description="least prominence of a force peak, in P0; absent: 0.1, and more than noise and ripple",
    )
    draws: Annotated[int, Field(ge=16, le=2048, strict=True)] = Field(
        64, description="model runs with inputs drawn from their standard uncertainties"
    )


class Report(Table):
    """[report]: the page."""

    frames_shown: Annotated[int, Field(ge=1, le=60, strict=True)] = Field(
        4, description="stages shown side by side"
    )
