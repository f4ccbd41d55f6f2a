"""A page of small pictures: how each spoiled photograph looks."""

from collections.abc import Mapping
from pathlib import Path

import cv2
from matplotlib.figure import Figure

from drawing.png import save_light
from drawing.style import style
from sequences.spoil import photos_of

_COLUMNS = 4


def draw_sheet(folders: Mapping[str, Path], frame: int, path: Path) -> None:
    """The spoiled photograph of each test, by name; white where it cannot be read."""
    rows = -(-len(folders) // _COLUMNS)
    with style():
        figure = Figure(figsize=(10.4, 1.35 * rows), layout="constrained")
        for ax, (name, folder) in zip(
            figure.subplots(rows, _COLUMNS, squeeze=False).flat, folders.items(), strict=False
        ):
            ax.set_title(name, fontsize=7)
            photos = photos_of(folder)
            stem = f"{frame:04d}"
            shown = next((p for p in photos if p.stem == stem), None)
            picture = None if shown is None else cv2.imread(str(shown), cv2.IMREAD_GRAYSCALE)
            if picture is None:
                ax.text(0.5, 0.5, "not there" if shown is None else "cannot be read", ha="center", fontsize=7)
            else:
                small = cv2.resize(picture, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
                ax.imshow(small, cmap="gray", vmin=0, vmax=255)
        for ax in figure.axes:
            ax.set_axis_off()
        save_light(figure, path)
