"""One frame of the player as a drawing without scripts: predicted above, measured below on the same axes.

``templates/player_stage.js`` draws the same at any width; this one is what print and readers without scripts
see, and what the page shows until the script runs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from ploughval.report.figures.layers import Extent
from ploughval.report.player.coding import unpack_lines
from ploughval.report.player.lines import FrameLines, Lines

WIDTH_PX = 720.0
_LEFT, _RIGHT, _TOP, _BOTTOM, _GAP = 46.0, 8.0, 8.0, 40.0, 10.0
_TALLEST = 620.0  # of both panels
_FLAT = 0.55
_DIGITS = 2

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Panels:
    """Where the panels stand: scale in px a mm, left and top edges, size; as the script lays them out."""

    extent: Extent
    names: tuple[str, ...]
    scale: float
    left: float

    @classmethod
    def of(cls, extent: Extent, names: tuple[str, ...]) -> "Panels":
        """Panels one above the other within the width, and no taller than a screen."""
        x0, x1, y0, y1 = extent
        room = WIDTH_PX - _LEFT - _RIGHT
        scale = min(room / (x1 - x0), (_TALLEST - _GAP) / len(names) / (y1 - y0))
        return cls(extent, names, scale, _LEFT + (room - scale * (x1 - x0)) / 2)

    @property
    def width(self) -> float:
        """Of a panel, px."""
        return self.scale * (self.extent[1] - self.extent[0])

    @property
    def height(self) -> float:
        """Of a panel, px."""
        return self.scale * (self.extent[3] - self.extent[2])

    @property
    def size(self) -> tuple[float, float]:
        """Of the drawing, px."""
        count = len(self.names)
        return WIDTH_PX, _TOP + count * self.height + (count - 1) * _GAP + _BOTTOM

    @property
    def flat(self) -> bool:
        """Whether the drawing is so low that it is better seen over the whole page than beside the force."""
        width, height = self.size
        return height < _FLAT * width

    def top(self, panel: int) -> float:
        """Upper edge of a panel, px."""
        return _TOP + panel * (self.height + _GAP)

    def px(self, mm: Floats, panel: int) -> Floats:
        """World places (N, 2), mm, in the drawing, px."""
        x0, _, _, y1 = self.extent
        return np.column_stack(
            [self.left + (mm[:, 0] - x0) * self.scale, self.top(panel) + (y1 - mm[:, 1]) * self.scale]
        )


@dataclass(frozen=True, slots=True)
class Scene:
    """What the drawing shows: blade's face (travel and as seen), its thickness, the photograph."""

    u_mm: float
    blade_mm: float
    thickness_mm: float
    image: str = ""
    image_extent: Extent = (0.0, 1.0, 0.0, 1.0)


def still(panels: Panels, lines: Lines, row: int, scene: Scene) -> Markup:
    """The inside of the drawing's element.

    Parameters
    ----------
    panels : Panels
        Where things stand; predicted before measured where there are both.
    lines : Lines
        Lines of all frames.
    row : int
        The frame that is drawn.
    scene : Scene
        Its blade and photograph.
    """
    parts = [
        f'<clipPath id="player-still-{k}"><rect x="{panels.left:.1f}" y="{panels.top(k):.1f}" '
        f'width="{panels.width:.1f}" height="{panels.height:.1f}"/></clipPath>'
        for k in range(len(panels.names))
    ]
    for k, name in enumerate(panels.names):
        parts.append(f'<g clip-path="url(#player-still-{k})">{_panel(panels, k, lines, row, scene)}</g>')
        parts.append(_frame(panels, k, name))
    return Markup("".join(parts))


def _panel(panels: Panels, k: int, lines: Lines, row: int, scene: Scene) -> str:
    frame, tolerance = lines.frames[row], lines.tolerance_mm
    predicted = panels.names[k] == "predicted"
    photo = bool(scene.image) and not predicted
    surface = [p for _, p in unpack_lines(_surface(frame, predicted), tolerance)]
    parts = [_photograph(panels, k, scene) if photo else _sand(panels, k, surface)]
    halo = " over" if photo else ""
    own = frame.model_layers if predicted else frame.layers
    if not predicted:
        parts.append(_layers(panels, k, frame.model_layers, lines, f"model thin{halo}"))
    parts.append(_layers(panels, k, own, lines, ("model" if predicted else "measured") + halo))
    parts.append(_group("surface", _path(panels, k, surface, f"ground{halo}")))
    for ends, kind in ((frame.model_band_mm, "model"), (frame.band_mm, "measured")):
        if predicted and kind == "measured":
            continue
        tips = [np.array([[scene.u_mm, 0.0], end]) for end in ends]
        parts.append(_group("bands", _path(panels, k, tips, f"band {kind}{halo}")))
    face = scene.u_mm if predicted or not np.isfinite(scene.blade_mm) else scene.blade_mm
    parts.append(_blade(panels, k, face, scene.thickness_mm, halo))
    return "".join(parts)


def _surface(frame: FrameLines, predicted: bool) -> str:
    return frame.model_surface if predicted else frame.surface


def _layers(panels: Panels, k: int, text: str, lines: Lines, kind: str) -> str:
    drawn = unpack_lines(text, lines.tolerance_mm)
    name = "layers-predicted" if kind.startswith("model") else "layers-measured"
    dyed = [points for tag, points in drawn if lines.layers[tag][0] == "dye"]
    plain = [points for tag, points in drawn if lines.layers[tag][0] != "dye"]
    # Beads of dyed sand lie under the line of tracked points, where both were found.
    pairs = [_path(panels, k, dyed, f"dyed {kind}"), _path(panels, k, plain, kind)]
    return _group(name, [halo for halo, _ in pairs] + [line for _, line in pairs])


def _photograph(panels: Panels, k: int, scene: Scene) -> str:
    x0, x1, y0, y1 = scene.image_extent
    corners = panels.px(np.array([[x0, y1], [x1, y0]]), k)
    (left, top), (right, bottom) = corners
    image = (
        f'<image href="{scene.image}" x="{left:.2f}" y="{top:.2f}" width="{right - left:.2f}" '
        f'height="{bottom - top:.2f}" preserveAspectRatio="none"/>'
    )
    return _group("photograph", [image])


def _sand(panels: Panels, k: int, surface: Sequence[Floats]) -> str:
    low = panels.extent[2] - 1.0
    shapes = []
    for line in surface:
        if len(line) > 1:
            below = np.array([[line[-1, 0], low], [line[0, 0], low]])
            shapes.append(np.vstack([line, below]))
    return _group("sand", _path(panels, k, shapes, "sand", closed=True))


def _blade(panels: Panels, k: int, face: float, thickness: float, halo: str) -> str:
    if not np.isfinite(face):
        return ""
    (left, top), (right, bottom) = panels.px(np.array([[face - thickness, panels.extent[3]], [face, 0.0]]), k)
    box = (
        f'<rect class="blade{halo}" x="{left:.2f}" y="{top:.2f}" width="{right - left:.2f}" '
        f'height="{bottom - top:.2f}"/>'
    )
    return _group("blade", [box])


def _path(
    panels: Panels, k: int, lines: Sequence[Floats], kind: str, *, closed: bool = False
) -> tuple[str, str]:
    """A path, and before it the light one below it where it lies over the photograph."""
    steps = []
    for line in lines:
        places = np.round(panels.px(line, k), _DIGITS)
        text = "L".join(f"{x:g} {y:g}" for x, y in places.tolist())
        steps.append(f"M{text}{'z' if closed else ''}")
    if not steps:
        return "", ""
    d, plain = "".join(steps), kind.removesuffix(" over")
    halo = f'<path class="halo {plain}" d="{d}"/>' if plain != kind else ""
    return halo, f'<path class="{kind}" d="{d}"/>'


def _group(layer: str, parts: Sequence[str]) -> str:
    inner = "".join(parts)
    return f'<g data-layer="{layer}">{inner}</g>' if inner else ""


def _frame(panels: Panels, k: int, name: str) -> str:
    """Border, ticks and words of a panel."""
    x0, x1, y0, y1 = panels.extent
    left, top, right, bottom = panels.left, panels.top(k), panels.left + panels.width, 0.0
    bottom = top + panels.height
    parts = [
        f'<rect class="edge" x="{left:.1f}" y="{top:.1f}" width="{panels.width:.1f}" '
        f'height="{panels.height:.1f}"/>'
    ]
    for y in ticks(y0, y1, 4):
        at = panels.px(np.array([[x0, y]]), k)[0, 1]
        parts.append(f'<text x="{left - 6:.1f}" y="{at + 4:.1f}" text-anchor="end">{_number(y)}</text>')
    if k == len(panels.names) - 1:
        for x in ticks(x0, x1, 8):
            at = panels.px(np.array([[x, 0.0]]), k)[0, 0]
            parts.append(f'<text x="{at:.1f}" y="{bottom + 15:.1f}" text-anchor="middle">{_number(x)}</text>')
        middle = (left + right) / 2
        parts.append(f'<text x="{middle:.1f}" y="{bottom + 33:.1f}" text-anchor="middle">x, mm</text>')
    at = (top + bottom) / 2
    turned = f"rotate(-90 {left - 34:.1f} {at:.1f})"
    parts.append(
        f'<text x="{left - 34:.1f}" y="{at:.1f}" text-anchor="middle" transform="{turned}">y, mm</text>'
    )
    tag = f'x="{right - 8:.1f}" y="{top + 18:.1f}" text-anchor="end"'
    parts.append(f'<text class="tag" {tag}>{name}</text>')
    return "".join(parts)


def ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers between two ends, at most so many.

    >>> ticks(-9.0, 67.0, 4)
    [0.0, 20.0, 40.0, 60.0]
    """
    for power in range(-3, 13):
        for step in (1, 2, 5):
            size = step * 10.0**power
            first, last = np.ceil(low / size), np.floor(high / size)
            if last - first < most:
                return [float(round(place, 9)) + 0.0 for place in np.arange(first, last + 1) * size]
    return []


def _number(value: float) -> str:
    return f"{value:g}".replace("-", "−")
