"""What a painted dot or a drawn circle looks like: a blurred elliptic rim under light that changes slowly.

The rim is the ellipse p = c + R (I + [[a, b], [b, -a]]) (cos t, sin t): centre c, radius R, stretch (a, b).
Beside it the grey level follows the error function, which is the edge of a camera's blur (Gaussian) seen
straight on; the curvature of the rim moves the place of half the contrast inwards by s^2 / 2R, s: the blur.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Kind = Literal["dot", "ring"]

CX, CY, RADIUS, STRETCH, SKEW, BLUR, OUTSIDE, INSIDE, LIGHT_X, LIGHT_Y, VEIL_X, VEIL_Y, LINE = range(13)
"""Places of the parameters: centre, radius, stretch (a, b), blur, grey levels, slopes of the light
(relative) and of glare (grey) by the radius, width of the line of a drawn circle; px and grey."""
LEAST_BLUR_PX = 0.3
"""A perfectly sharp edge integrated over pixels is about as wide."""


@dataclass(frozen=True, slots=True)
class Rim:
    """The model at pixels: their grey levels, distances from the rim and derivatives.

    Attributes
    ----------
    grey : (P,) float
    off_px : (P,) float
        Distance from the rim, positive outside.
    slope : (P,) float
        Derivative of the grey level by an outward movement of the rim.
    jacobian : (P, K) float
        Derivatives by the parameters.
    """

    grey: Floats
    off_px: Floats
    slope: Floats
    jacobian: Floats


def rim_at(x: Floats, y: Floats, theta: Floats, kind: Kind) -> Rim:
    """The model at pixels (P,) x, y for parameters (12,), or (13,) for a ring (docs/markers.md, Eq. (1))."""
    off, normal, unit = _distance(x - theta[CX], y - theta[CY], theta)
    bend = theta[BLUR] ** 2 / (2 * theta[RADIUS])
    share, by_off, by_blur, by_line = _PROFILES[kind](off + bend, theta)
    u, v = (x - theta[CX]) / theta[RADIUS], (y - theta[CY]) / theta[RADIUS]
    light = 1 + theta[LIGHT_X] * u + theta[LIGHT_Y] * v
    contrast = theta[INSIDE] - theta[OUTSIDE]
    level = theta[OUTSIDE] + contrast * share
    slope = light * contrast * by_off
    (nx, ny), (ux, uy) = normal, unit
    a, b, radius = theta[STRETCH], theta[SKEW], theta[RADIUS]
    columns = [
        -slope * nx,
        -slope * ny,
        -slope * (nx * ((1 + a) * ux + b * uy) + ny * (b * ux + (1 - a) * uy)),
        -slope * radius * (nx * ux - ny * uy),
        -slope * radius * (nx * uy + ny * ux),
        light * contrast * (by_blur + by_off * theta[BLUR] / radius),
        light * (1 - share),
        light * share,
        level * u,
        level * v,
        u,
        v,
    ]
    if kind == "ring":
        columns.append(light * contrast * by_line)
    veil = theta[VEIL_X] * u + theta[VEIL_Y] * v
    return Rim(light * level + veil, off, -slope, np.stack(columns, axis=1))


def _distance(
    dx: Floats, dy: Floats, theta: Floats
) -> tuple[Floats, tuple[Floats, Floats], tuple[Floats, Floats]]:
    """Distance from the ellipse to first order (Sampson 1982), outward normal, place on the unit circle."""
    a, b = theta[STRETCH], theta[SKEW]
    scale = theta[RADIUS] * (1 - a * a - b * b)
    qx, qy = ((1 - a) * dx - b * dy) / scale, ((1 + a) * dy - b * dx) / scale
    far = np.maximum(np.hypot(qx, qy), 1e-9)
    ux, uy = qx / far, qy / far
    gx, gy = ((1 - a) * ux - b * uy) / scale, ((1 + a) * uy - b * ux) / scale
    steep = np.hypot(gx, gy)
    return (far - 1) / steep, (gx / steep, gy / steep), (ux, uy)


def _dot(off: Floats, theta: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Share of the inner level at a distance, and its derivatives by distance, blur and line."""
    t = off / theta[BLUR]
    density = _density(t) / theta[BLUR]
    return _below(-t), -density, t * density, np.zeros_like(t)


def _ring(off: Floats, theta: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """The same for a line about the rim."""
    blur, half = theta[BLUR], theta[LINE] / 2
    outer, inner = (off - half) / blur, (off + half) / blur
    out, inn = _density(outer) / blur, _density(inner) / blur
    return _below(-outer) - _below(-inner), inn - out, outer * out - inner * inn, (out + inn) / 2


def contrast_at(theta: Floats) -> float:
    """Grey level inside less that outside; for a ring, that of its blurred line."""
    contrast = float(theta[INSIDE] - theta[OUTSIDE])
    if len(theta) <= LINE:
        return contrast
    return contrast * (2 * float(_below(theta[LINE] / (2 * theta[BLUR]))) - 1)


_PROFILES = {"dot": _dot, "ring": _ring}


def _density(t: Floats) -> Floats:
    return np.asarray(np.exp(-0.5 * t * t) / np.sqrt(2 * np.pi))


def _below(t: Floats) -> Floats:
    from scipy.special import ndtr  # loads slowly; test folders without markers do without

    return np.asarray(ndtr(t))
