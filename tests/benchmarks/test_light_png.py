"""Pictures with a palette: thin coloured lines over grey sand keep their colour; bytes are the same."""

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from drawing.png import COLOURS, lighten, save_light


def sand_with_line(path):
    """Grey noise with one line of a colour, as RGBA."""
    grey = np.random.default_rng(1).integers(60, 220, (120, 200), dtype=np.uint8)
    picture = np.dstack([grey, grey, grey, np.full_like(grey, 255)])
    picture[60, :, :3] = (213, 94, 0)
    Image.fromarray(picture).save(path)


def test_a_thin_line_over_sand_keeps_its_colour_and_the_file_shrinks_to_half(tmp_path):
    path = tmp_path / "sand.png"
    sand_with_line(path)
    before = path.stat().st_size
    assert lighten(path) < before / 2
    with Image.open(path) as picture:
        assert len(picture.getcolors()) <= COLOURS
        line = np.asarray(picture.convert("RGB"), int)[60]
    # an octree of 64 colours keeps the upper bits of each channel: 32 levels of 256
    assert np.abs(line - [213, 94, 0]).max() <= 32
    assert np.ptp(line, axis=0).max() <= 16


def test_a_picture_that_has_a_palette_is_left_as_it_is(tmp_path):
    path = tmp_path / "sand.png"
    sand_with_line(path)
    lighten(path)
    first = path.read_bytes()
    lighten(path)
    assert path.read_bytes() == first


def test_the_same_figure_gives_the_same_bytes(tmp_path):
    for name in ("a.png", "b.png"):
        figure = Figure(figsize=(2.0, 1.0))
        figure.subplots().plot([0, 1], [1, 0])
        save_light(figure, tmp_path / name, dpi=60)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
