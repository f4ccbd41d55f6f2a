"""Reading photographs: seconds a megapixel, peak memory and error against the stored samples, by format.

Each format is measured in a process of its own, after a small picture of the same kind: what is loaded for
the first time does not count. The truth is the picture before it was written; for formats that lose
something, what another decoder makes of the file.
"""

import argparse
import csv
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import tifffile
from PIL import Image

from ploughval.photos import open_frames
from ploughval.photos.reading.decode import decode, read_header
from ploughval.scene import Scene
from ploughval.synth import sand_texture

COLUMNS = (
    "format",
    "megapixels",
    "megabytes",
    "header_ms",
    "ms_per_megapixel",
    "peak_mb_per_megapixel",
    "error_levels",
)
SHAPE = (4000, 6000)
SMALL = (64, 96)
FRAMES = 12
LUMA = np.array([0.299, 0.587, 0.114])


@dataclass(frozen=True)
class Format:
    """How a format is written, and the most that reading may differ from the truth, grey levels."""

    name: str
    ending: str
    samples: str  # grey8, grey16, colour8, colour16
    options: tuple = ()
    lossy: bool = False
    pictures: int = 1


FORMATS = (
    Format("JPEG, grey", "jpg", "grey8", (("quality", 95),), lossy=True),
    Format("JPEG, colour", "jpg", "colour8", (("quality", 95),), lossy=True),
    Format("PNG, grey", "png", "grey8"),
    Format("PNG, 16-bit grey", "png", "grey16"),
    Format("PNG, colour", "png", "colour8"),
    Format("BMP, colour", "bmp", "colour8"),
    Format("TIFF, 16-bit grey", "tif", "grey16"),
    Format("TIFF, 16-bit colour", "tif", "colour16"),
    Format("TIFF, 16-bit grey, deflate", "tif", "grey16", (("compression", "zlib"), ("rowsperstrip", 64))),
    Format("TIFF, 16-bit grey, tiles", "tif", "grey16", (("compression", "zlib"), ("tile", (256, 256)))),
    Format("TIFF, grey, LZW", "tif", "grey8", (("compression", "tiff_lzw"),)),
    Format("JPEG 2000, 16-bit grey", "jp2", "grey16"),
    Format("video, FFV1, grey", "mkv", "grey8", pictures=4),
    Format("GIF, palette", "gif", "grey8", pictures=4),
)


def picture(samples, shape):
    """Sand of known samples."""
    generator = np.random.default_rng(1)
    tile = tuple(min(side, 1000) for side in shape)
    sand = sand_texture(generator, tile).picture(tile)
    grey = np.tile(sand, (-(-shape[0] // tile[0]), -(-shape[1] // tile[1])))
    grey = grey[: shape[0], : shape[1]] + generator.normal(0, 2, shape)
    grey = (grey / 255).clip(0, 1)
    bits = 8 if samples.endswith("8") else 16
    planes = grey if samples.startswith("grey") else np.dstack([grey, 0.9 * grey, 0.7 * grey])
    return (((1 << bits) - 1) * planes).round().astype(np.uint8 if bits == 8 else np.uint16)


def write(path, kind, samples):
    """The picture as a file of its format."""
    options = dict(kind.options)
    if kind.ending == "mkv":
        fourcc = cv2.VideoWriter_fourcc(*"FFV1")
        video = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, fourcc, 10, samples.shape[1::-1], False)
        for number in range(kind.pictures):
            video.write(np.roll(samples, number, axis=1))
        video.release()
    elif kind.ending == "gif":
        rolled = [Image.fromarray(np.roll(samples, k, axis=1)) for k in range(kind.pictures)]
        rolled[0].save(path, save_all=True, append_images=rolled[1:], duration=100)
    elif kind.ending == "jp2" or (kind.ending == "png" and samples.dtype == np.uint16):
        lossless = [cv2.IMWRITE_JPEG2000_COMPRESSION_X1000, 1000] if kind.ending == "jp2" else []
        cv2.imwrite(str(path), samples, lossless)
    elif kind.ending == "tif" and options.get("compression") != "tiff_lzw":
        photometric = "rgb" if samples.ndim == 3 else "minisblack"
        tifffile.imwrite(path, samples, photometric=photometric, **options)
    else:
        Image.fromarray(samples).save(path, **options)


def error(path, kind, samples, found):
    """Largest difference from the truth, grey levels; half a level is rounding."""
    if kind.lossy:
        truth = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
    else:
        truth = samples
    worst = 0.0
    for part in np.array_split(np.arange(len(found)), 16):
        expected = truth[part].astype(float)
        expected = expected @ LUMA if expected.ndim == 3 else expected
        worst = max(worst, float(np.abs(found[part] - expected).max()))
    return worst


def measure(folder, number):
    """Read one file in this process: seconds and peak memory."""
    kind = FORMATS[number]
    decode(folder / f"small.{kind.ending}")
    path = folder / f"large.{kind.ending}"
    begun = time.perf_counter()
    read_header(path)
    header_s = time.perf_counter() - begun
    before = peak_mb()
    seconds = []
    for _ in range(3):
        begun = time.perf_counter()
        found = decode(path)
        seconds.append(time.perf_counter() - begun)
    return {
        "header_s": header_s,
        "seconds": min(seconds),
        "peak_mb": peak_mb() - before,
        "bytes": found.nbytes,
    }


def peak_mb():
    """Most memory that this program has held, MB; what the program that started it held does not count."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(float(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))


def row(number, shape):
    """One line of the table."""
    kind = FORMATS[number]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(folder / f"small.{kind.ending}", kind, picture(kind.samples, SMALL))
        samples = picture(kind.samples, shape)
        path = folder / f"large.{kind.ending}"
        write(path, kind, samples)
        found = apart("--format", str(number), "--folder", name)
        pixels = shape[0] * shape[1] / 1e6
        return (
            kind.name,
            pixels,
            path.stat().st_size / kind.pictures / 1e6,
            1000 * found["header_s"],
            1000 * found["seconds"] / pixels,
            found["peak_mb"] / pixels,
            error(path, kind, samples, decode(path)),
        )


def series(folder):
    """Read a folder of JPEGs frame after frame in this process."""
    scene = Scene.model_validate(
        {
            "folder": folder,
            "test": {"name": "series"},
            "blade": {"depth_mm": 30.0, "width_mm": 200.0},
            "camera": {
                "photos": "*.jpg",
                "times": {"start_s": 0, "interval_s": 1},
                "mm_per_px": 0.1,
                "tip_px": [5, 6],
            },
        }
    )
    before = peak_mb()
    begun = time.perf_counter()
    frames = open_frames(scene)
    header_s = time.perf_counter() - begun
    for number in range(len(frames)):
        frames.read(number)
    seconds = (time.perf_counter() - begun) / len(frames)
    return {"header_s": header_s / len(frames), "seconds": seconds, "peak_mb": peak_mb() - before}


def series_row(shape):
    """A series opened and read through: time a frame, memory of the whole."""
    with tempfile.TemporaryDirectory() as name:
        samples = picture("grey8", shape)
        for number in range(FRAMES):
            Image.fromarray(np.roll(samples, number, axis=1)).save(Path(name) / f"{number}.jpg", quality=95)
        found = apart("--series", "--folder", name)
        pixels = shape[0] * shape[1] / 1e6
        size = (Path(name) / "0.jpg").stat().st_size / 1e6
        name = f"series of {FRAMES} JPEGs, grey"
        times = (1000 * found["header_s"], 1000 * found["seconds"] / pixels, found["peak_mb"] / pixels)
        return (name, pixels, size, *times, float("nan"))


def apart(*options):
    """Run this script in a process of its own and take the result that it prints."""
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    line = [sys.executable, __file__, *options]
    done = subprocess.run(line, stdout=subprocess.PIPE, text=True, check=True, env=environment)
    return json.loads(done.stdout)


def main(argv=None):
    """Print the table and write it as CSV."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    parser.add_argument("--quick", action="store_true", help="a megapixel in place of 24")
    parser.add_argument("--format", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--series", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args(argv)
    if options.folder:
        found = series(options.folder) if options.series else measure(options.folder, options.format)
        print(json.dumps(found))
        return
    shape = (1000, 1000) if options.quick else SHAPE
    rows = [*(row(number, shape) for number in range(len(FORMATS))), series_row(shape)]
    table = pd.DataFrame(rows, columns=list(COLUMNS))
    print(table.to_string(index=False, float_format=lambda v: f"{v:.3g}"))
    options.out.mkdir(parents=True, exist_ok=True)
    with (options.out / "photos.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*COLUMNS, "machine", "python", "pillow", "opencv"])
        made = (platform.machine(), platform.python_version(), Image.__version__, cv2.__version__)
        writer.writerows([line[0], *(f"{value:.4g}" for value in line[1:]), *made] for line in rows)


if __name__ == "__main__":
    main()
