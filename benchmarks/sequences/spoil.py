"""What goes wrong in a laboratory: ways to spoil the photographs of a made test folder."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.synth import Truth, load_truth
from ploughval.synth.bed import fill_bed
from ploughval.synth.options import Purpose
from ploughval.synth.view import expose, frame_view, light_field

Picture = NDArray[np.float32]

KNOCK_PX = (2.4, -1.8)  # three pixels in all


@dataclass(frozen=True, slots=True)
class Spoil:
    """One fault.

    Attributes
    ----------
    name : str
    work : callable
        Changes a folder in place; takes the folder, the photograph it is about, and a generator.
    all_frames : bool
        Whether every photograph is touched, or only one or two.
    """

    name: str
    work: Callable[[Path, int, np.random.Generator], None]
    all_frames: bool = False


def photos_of(folder: Path) -> list[Path]:
    """Photographs by name."""
    return sorted((folder / "photos").iterdir())


def change(path: Path, by: Callable[[Picture], Picture]) -> None:
    """Rewrite one photograph; the file is new, as the old one may be shared with another folder."""
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE).astype(np.float32)
    levels = np.clip(np.rint(by(picture)), 0, 255).astype(np.uint8)
    path.unlink()
    cv2.imwrite(str(path), levels)


def change_all(folder: Path, by: Callable[[Picture], Picture]) -> None:
    """Rewrite every photograph in the same way."""
    for path in photos_of(folder):
        change(path, by)


def untouched(folder: Path, frame: int, rng: np.random.Generator) -> None:
    """Nothing is spoiled."""


def missing(folder: Path, frame: int, rng: np.random.Generator) -> None:
    """The camera did not store one photograph; its time is still listed."""
    photos_of(folder)[frame].unlink()


def gap(folder: Path, frame: int, rng: np.random.Generator) -> None:
    """One photograph was never taken: neither file nor time."""
    path = photos_of(folder)[frame]
    path.unlink()
    _retime(folder, lambda table: table[table["file"] != path.name])


def truncated(folder: Path, frame: int, rng: np.random.Generator) -> None:
    """The second half of a file was lost."""
    path = photos_of(folder)[frame]
    data = path.read_bytes()
    path.unlink()
    path.write_bytes(data[: len(data) // 2])


def doubled(folder: Path, frame: int, rng: np.random.Generator) -> None:
    """One photograph was stored twice, a tenth of an interval apart."""
    path = photos_of(folder)[frame]
    again = path.with_name(f"{path.stem}b{path.suffix}")
    again.write_bytes(path.read_bytes())

    def added(table: pd.DataFrame) -> pd.DataFrame:
        row = table[table["file"] == path.name].copy()
        row["file"] = again.name
        row["time_s"] += 0.1 * float(np.diff(table["time_s"]).mean())
        return pd.concat([table, row]).sort_values("time_s")

    _retime(folder, added)


def swapped(folder: Path, frame: int, rng: np.random.Generator) -> None:
    """Two photographs bear each other's times."""
    one, other = photos_of(folder)[frame], photos_of(folder)[frame + 1]
    aside = one.with_name("aside")
    one.rename(aside)
    other.rename(one)
    aside.rename(other)


def shuffled(folder: Path, frame: int, rng: np.random.Generator) -> None:
    """The list of times is out of order."""
    _retime(folder, lambda table: table.iloc[rng.permutation(len(table))])


def blurred(folder: Path, frame: int, rng: np.random.Generator) -> None:
    """Out of focus: a blur of three pixels."""
    change(photos_of(folder)[frame], lambda p: cv2.GaussianBlur(p, (0, 0), 3.0))


def over_exposed(folder: Path, frame: int, rng: np.random.Generator) -> None:
    """Gain 1.8, clipped at white."""
    change(photos_of(folder)[frame], lambda p: 1.8 * p)


def knocked(folder: Path, frame: int, rng: np.random.Generator) -> None:
    """The camera was knocked before ``frame`` and stayed so: the same grains in a frame shifted by 3 px."""
    truth = load_truth(folder)
    paths = photos_of(folder)
    for number, picture in _shifted(truth, range(frame, len(paths))):
        paths[number].unlink()
        cv2.imwrite(str(paths[number]), picture)


def _shifted(truth: Truth, frames: Iterable[int]) -> Iterable[tuple[int, NDArray[np.uint8]]]:
    options = truth.options
    view = frame_view(truth.motion, options)
    moved = replace(view, tip_px=(view.tip_px[0] + KNOCK_PX[0], view.tip_px[1] + KNOCK_PX[1]))
    bed = fill_bed(options.rng(Purpose.GRAINS), view, truth.motion, options)
    canvas = bed.canvas(view.shape, options.air_grey)
    light = light_field(view.shape, vignetting=options.vignetting, gradient=options.gradient)
    falls = options.rng(Purpose.AVALANCHES)
    for frame in frames:
        bed.advance(truth.motion, int(truth.motion.frame_steps[frame]), falls)
        picture = canvas.draw(moved.to_px(bed.positions_mm)) + np.float32(options.air_grey)
        cover = moved.blade_cover(float(options.frames_u_mm[frame]), options.thickness_mm)
        picture += cover * (np.float32(options.blade_grey) - picture)
        noise = options.rng(Purpose.NOISE, frame)
        yield frame, expose(picture * light, noise, noise_grey=options.noise_grey, bit_depth=8)


def flickering(folder: Path, frame: int, rng: np.random.Generator) -> None:
    """Light that changes by up to 10 % from one photograph to the next."""
    for path in photos_of(folder):
        gain = np.float32(rng.uniform(0.9, 1.1))
        change(path, lambda p, gain=gain: gain * p)


def hand(folder: Path, frame: int, rng: np.random.Generator) -> None:
    """A hand before a third of the picture, out of focus, grey as skin in this light."""

    def covered(picture: Picture) -> Picture:
        height, width = picture.shape
        shape = np.zeros_like(picture)
        for x, y, a, b, turn in (
            (0.55, 0.22, 0.22, 0.5, 25),
            (0.47, 0.6, 0.05, 0.3, 10),
            (0.6, 0.6, 0.05, 0.28, 30),
        ):
            middle, axes = (round(x * width), round(y * height)), (round(a * width), round(b * height))
            cv2.ellipse(shape, middle, axes, turn, 0, 360, 1.0, -1)
        share = cv2.GaussianBlur(shape, (0, 0), 8.0)
        skin = (
            95 + 12 * cv2.GaussianBlur(rng.standard_normal(picture.shape).astype(np.float32), (0, 0), 20) * 30
        )
        return share * skin + (1 - share) * picture

    change(photos_of(folder)[frame], covered)


def streaked(folder: Path, frame: int, rng: np.random.Generator) -> None:
    """A lamp is reflected in the window: a bright slanting streak in every photograph."""

    def lit(picture: Picture) -> Picture:
        y, x = np.mgrid[: picture.shape[0], : picture.shape[1]].astype(np.float32)
        across = (x - 0.55 * picture.shape[1] + 0.5 * y) / 25.0
        return picture + 50 * np.exp(-(across**2) / 2)

    change_all(folder, lit)


def dirty(folder: Path, frame: int, rng: np.random.Generator) -> None:
    """Specks of dirt on the window, in the same place in every photograph."""
    height, width = cv2.imread(str(photos_of(folder)[0]), cv2.IMREAD_GRAYSCALE).shape
    clear = np.ones((height, width), np.float32)
    for x, y, radius in zip(
        rng.uniform(0, width, 40), rng.uniform(0, height, 40), rng.uniform(2, 9, 40), strict=True
    ):
        cv2.circle(clear, (round(x), round(y)), round(radius), 0.4, -1)
    clear = cv2.GaussianBlur(clear, (0, 0), 1.5)
    change_all(folder, lambda p: clear * p)


def compressed(folder: Path, frame: int, rng: np.random.Generator) -> None:
    """JPEG of quality 70."""
    for path in photos_of(folder):
        picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        cv2.imwrite(str(path.with_suffix(".jpg")), picture, [cv2.IMWRITE_JPEG_QUALITY, 70])
        path.unlink()
    _retime(folder, lambda t: t.assign(file=t["file"].str.replace(r"\.\w+$", ".jpg", regex=True)))
    settings = (folder / "test.toml").read_text(encoding="utf-8")
    text = re.sub(r"photos/\*\.\w+", "photos/*.jpg", settings)
    (folder / "test.toml").unlink()  # it may be shared with another folder
    (folder / "test.toml").write_text(text, encoding="utf-8")


def one_sided(folder: Path, frame: int, rng: np.random.Generator) -> None:
    """Lit from one side: 60 % less light at the far end."""

    def darker(picture: Picture) -> Picture:
        return picture * np.linspace(1.15, 0.46, picture.shape[1], dtype=np.float32)

    change_all(folder, darker)


def _retime(folder: Path, by: Callable[[pd.DataFrame], pd.DataFrame]) -> None:
    path = folder / "photos.csv"
    table = by(pd.read_csv(path))
    path.unlink()
    table.to_csv(path, index=False, lineterminator="\n")


SPOILS = (
    Spoil("untouched", untouched, all_frames=True),
    Spoil("a photograph missing, its time listed", missing),
    Spoil("a photograph never taken", gap),
    Spoil("a file cut in half", truncated),
    Spoil("a photograph twice", doubled),
    Spoil("two photographs with each other's time", swapped),
    Spoil("times listed out of order", shuffled, all_frames=True),
    Spoil("one out of focus", blurred),
    Spoil("one over-exposed", over_exposed),
    Spoil("camera knocked by 3 px half-way", knocked, all_frames=True),
    Spoil("light flickers by 10 %", flickering, all_frames=True),
    Spoil("a hand in one picture", hand),
    Spoil("a reflection on the window", streaked, all_frames=True),
    Spoil("dirt on the window", dirty, all_frames=True),
    Spoil("JPEG of quality 70", compressed, all_frames=True),
    Spoil("lit from one side", one_sided, all_frames=True),
)
"""Every fault, the clean test first."""
