"""What Pillow decodes, as samples of 8 or 16 bits without alpha."""

import numpy as np
from PIL import Image

from ploughval.photos.reading.grey import ROWS, Samples


def samples_of(image: Image.Image) -> Samples:
    """Samples of an image, (H, W) or (H, W, 3); ValueError where they are neither of 8 nor of 16 bits."""
    if image.mode in ("I", "F"):
        raise ValueError(f"samples of mode {image.mode}; expected 8 or 16 bit")
    if image.mode.startswith("I;16"):
        return np.asarray(image).astype(np.uint16)
    if image.mode in ("L", "RGB"):
        return np.asarray(image)
    mode, samples = ("LA", 1) if image.mode in ("1", "LA", "La") else ("RGBA", 3)
    width, height = image.size
    found = np.empty((height, width, samples), np.uint8)
    for top in range(0, height, ROWS):  # a large picture is not held in both modes
        part = image.crop((0, top, width, min(top + ROWS, height)))
        found[top : top + ROWS] = np.asarray(part.convert(mode))[..., :samples]
    return found[..., 0] if samples == 1 else found
