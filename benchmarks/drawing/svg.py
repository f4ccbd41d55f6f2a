"""Small figures of a page as small text: tenths of a unit, few points, few greys.

For figures a few centimetres wide; :mod:`ploughval.report.figures.svg` has written them in hundredths.
"""

import base64
import io
import re
import warnings
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from PIL import Image

TENTH = 0.1
GREYS = 6
NEAR_GREY = 24  # from the least to the largest of red, green and blue
_PATH = re.compile(r' d="([^"]+)"')
_PICTURE = re.compile(r'href="data:image/png;base64,([^"]+)"')
_STEP = re.compile(r"[a-zA-Z]|-?(?:\d+\.?\d*|\.\d+)")
_COUNTS = {"M": 2, "l": 2, "h": 1, "v": 1, "q": 4, "c": 6, "z": 0}

Places = NDArray[np.float64]


def light(page: str) -> str:
    """A page whose figures are lighter."""
    page = _PATH.sub(lambda found: f' d="{light_path(found[1])}"', page)
    return _PICTURE.sub(lambda found: f'href="data:image/png;base64,{light_picture(found[1])}"', page)


def light_path(text: str) -> str:
    """Path data of straight lines (M, l, h, v, z) in tenths and with fewer points; any other stays.

    >>> light_path("M10 20h.04l5.01 .02h5v9.96z")
    'M10 20h10v10z'
    """
    if re.search(r"[^Mlhvz\d\s.,-]", text):
        return text
    return "".join(_written(line, closed) for line, closed in _lines(text))


def _lines(text: str) -> Iterator[tuple[Places, bool]]:
    """Every line of a path, (N, 2), and whether it is closed."""
    points: list[tuple[float, float]] = []
    for letter, values in _steps(text):
        if letter == "M":
            if points:
                yield np.array(points), False
            points = [(values[0], values[1])]
        elif letter == "z":
            yield np.array(points), True
            points = points[:1]
        else:
            dx, dy = {"h": (values[0], 0.0), "v": (0.0, values[0])}.get(letter, (values[0], values[-1]))
            points.append((points[-1][0] + dx, points[-1][1] + dy))
    if len(points) > 1 or not text.endswith("z"):
        yield np.array(points), False


def _steps(text: str) -> Iterator[tuple[str, list[float]]]:
    tokens, letter, values = _STEP.findall(text), "", []
    for token in tokens:
        if token.isalpha():
            letter, values = token, []
        else:
            values.append(float(token))
        if letter and len(values) == _COUNTS[letter]:
            yield letter, values
            values = []


def thinned(points: Places) -> NDArray[np.bool_]:
    """Which points (N,) to keep for a line within half a tenth of them (Douglas and Peucker, 1973)."""
    keep = np.zeros(len(points), bool)
    keep[[0, -1]] = True
    parts = [(0, len(points) - 1)]
    while parts:
        first, last = parts.pop()
        if last - first < 2:
            continue
        way, inner = points[last] - points[first], points[first + 1 : last] - points[first]
        along = np.clip(inner @ way / max(float(way @ way), 1e-12), 0.0, 1.0)
        off = np.hypot(*(inner - along[:, None] * way).T)
        far = int(off.argmax())
        if off[far] > TENTH / 2:
            middle = first + 1 + far
            keep[middle] = True
            parts += [(first, middle), (middle, last)]
    return keep


def _written(points: Places, closed: bool) -> str:
    tenths = np.rint(points[thinned(points)] / TENTH).astype(int)
    moves = np.diff(tenths, axis=0)
    text, last = f"M{_number(tenths[0][0])}{_gapped(tenths[0][1])}", "M"
    for dx, dy in moves.tolist():
        if dx == dy == 0 and last != "M":
            continue
        letter, values = ("h", [dx]) if dy == 0 else ("v", [dy]) if dx == 0 else ("l", [dx, dy])
        head = _number(values[0]) if letter != last else _gapped(values[0])
        text += (letter if letter != last else "") + head + "".join(_gapped(v) for v in values[1:])
        last = letter
    return text + ("z" if closed else "")


def _number(tenths: int) -> str:
    whole, part = divmod(abs(int(tenths)), 10)
    text = f"{whole if whole or not part else ''}{f'.{part}' if part else ''}"
    return f"-{text}" if tenths < 0 else text


def _gapped(tenths: int) -> str:
    return _number(tenths) if tenths < 0 else f" {_number(tenths)}"


def light_picture(text: str) -> str:
    """A PNG, in base 64, with few greys where that makes it smaller; its colours stay."""
    data = base64.b64decode(text)
    with warnings.catch_warnings(), Image.open(io.BytesIO(data)) as picture:
        warnings.simplefilter("ignore")  # palettes with transparency
        samples = np.asarray(picture.convert("RGBA")).astype(np.int16)
    if (samples[..., 3] < 255).any():
        return text
    grey = np.ptp(samples[..., :3], axis=2) <= NEAR_GREY
    level = np.rint(samples[..., :3].mean(axis=2) * (GREYS - 1) / 255) * (255 / (GREYS - 1))
    few = np.where(grey[..., None], np.rint(level)[..., None], samples[..., :3]).astype(np.uint8)
    colours, place = np.unique(few.reshape(-1, 3), axis=0, return_inverse=True)
    if len(colours) > 256:
        return text
    reduced = Image.fromarray(place.reshape(grey.shape).astype(np.uint8))
    reduced.putpalette(colours.ravel().tolist())
    buffer = io.BytesIO()
    reduced.save(buffer, "PNG", optimize=True)
    small = buffer.getvalue()
    return base64.b64encode(small).decode() if len(small) < len(data) else text
