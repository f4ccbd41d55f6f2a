"""How often `ploughval init` is sure of its guesses, and wrong then, in made tests that are spoiled.

Run: python benchmarks/study_guesses.py [--tests 16]
"""

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Direction
from ploughval.run.setup.guesses import guess
from ploughval.synth import SynthOptions, make_folder

Picture = NDArray[np.float32]

WRONG_PX = 5.0
"""A tip or a depth that is off by more is wrong; with a tilt of 1.5 degrees it is not judged."""
SPOILED = ("none", "shake", "light", "clutter", "blur", "pale", "noise", "tilt")


def options(rng: np.random.Generator, number: int) -> SynthOptions:
    """A made test with travel, scale, greys and blade drawn."""
    return SynthOptions(
        seed=300 + number,
        frames=int(rng.integers(4, 14)),
        mm_per_px=float(rng.choice([0.25, 0.35, 0.45])),
        direction=[Direction.LEFT, Direction.RIGHT][number % 2],
        displacement_mm=float(rng.choice([8, 20, 45])),
        blade_grey=float(rng.choice([60, 120, 205])),
        air_grey=float(rng.choice([45, 90, 190])),
        thickness_mm=float(rng.choice([2.0, 5.0, 10.0])),
        dyed=bool(number % 3),
        loadcells=False,
    )


def spoiled(image: Picture, kind: str, frame: int, rng: np.random.Generator) -> Picture:
    """A photograph as another camera would have taken it."""
    height, width = image.shape
    if kind == "shake":
        moved = np.array([[1, 0, rng.normal(0, 1.5)], [0, 1, rng.normal(0, 1.5)]], np.float32)
        return cv2.warpAffine(image, moved, (width, height), borderMode=cv2.BORDER_REPLICATE)
    if kind == "light":
        return np.asarray(image * (1 + 0.25 * np.sin(frame)) + 5 * frame, np.float32)
    if kind == "clutter":
        behind, places = np.zeros_like(image), np.random.default_rng(3)
        for _ in range(12):
            x, y = int(places.integers(0, width - 20)), int(places.integers(0, height // 3))
            size = places.integers(5, 60), places.integers(10, 60)
            corner = (x + int(size[0]), y + int(size[1]))
            cv2.rectangle(behind, (x, y), corner, float(places.uniform(-30, 60)), -1)
        air = cv2.GaussianBlur(image, (0, 0), 3) < 70
        return np.where(air, image + behind, image)
    if kind == "blur":
        return cv2.GaussianBlur(image, (0, 0), 2.0)
    if kind == "pale":
        return np.asarray(100 + 0.15 * image + rng.normal(0, 2, image.shape), np.float32)
    if kind == "noise":
        return np.asarray(image + rng.normal(0, 20, image.shape), np.float32)
    if kind == "tilt":
        turn = cv2.getRotationMatrix2D((width / 2, height / 2), 1.5, 1)
        return cv2.warpAffine(image, turn, (width, height), borderMode=cv2.BORDER_REPLICATE)
    return image


def judged(rng: np.random.Generator, tests: int) -> Iterator[tuple[str, bool, bool, bool, bool]]:
    """For each test and way of spoiling: the way; blade sure, but turned; tip sure, but wrong."""
    for number in range(tests):
        with tempfile.TemporaryDirectory() as place:
            truth = make_folder(Path(place) / "test", options(rng, number))
            paths = sorted((Path(place) / "test" / "photos").iterdir())
            images = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE).astype(np.float32) for path in paths]
            for kind in SPOILED:
                for frame, (path, image) in enumerate(zip(paths, images, strict=True)):
                    levels = np.clip(spoiled(image, kind, frame, rng), 0, 255)
                    cv2.imwrite(str(path), levels.astype(np.uint8))
                found = guess([(path, 0) for path in paths], 8)
                sure = found.blade is not None and found.blade.sure
                other = sure and found.blade.direction != truth.options.direction
                told = sure and found.tip_sure and kind != "tilt"
                off = False
                if told:
                    depth_px = truth.options.depth_mm / truth.options.mm_per_px
                    error = np.abs([*np.subtract(found.tip_px, truth.tip_px), found.depth_px - depth_px])
                    off = bool(error.max() > WRONG_PX)
                yield kind, sure, other, told, off


def main() -> None:
    """Print one row a way of spoiling."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tests", type=int, default=16)
    rows = list(judged(np.random.default_rng(7), parser.parse_args().tests))
    print("| photographs | tests | direction sure | of them wrong | tip sure | of them wrong |")
    print("| --- | --: | --: | --: | --: | --: |")
    for kind in (*SPOILED, "all"):
        part = np.array([row[1:] for row in rows if kind in ("all", row[0])])
        print(f"| {kind} | {len(part)} | {' | '.join(map(str, part.sum(axis=0)))} |")


if __name__ == "__main__":
    main()
