"""The readers that are fuzzed, and a small sound file of each."""

import io
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from broken.base import make_sound
from ploughval import process
from ploughval.loadcells.calibration.table import read_table
from ploughval.loadcells.logs import read_log
from ploughval.photos.calibration.file import read_calibration
from ploughval.photos.reading.decode import decode, read_header
from ploughval.photos.series.times_table import table_times
from ploughval.results import read_results
from ploughval.scene import LogColumns, load_scene

_TABLE = b"load_N,arm_mm,upper,lower\n0,0,0,0\n5,0,1,0.6\n10,0,2,1.2\n5,0,1,0.6\n0,0,0,0\n"
_TIMES = b"file,time_s\n0.png,0\n1.png,2.5\n2.png,5\n"
_APART = "jpeg 2000, colours of 16 bits"
"""Read in a process of its own, which takes a third of a second."""
_NAMES = tuple(f"photos/{k}.png" for k in range(3))


@dataclass(frozen=True, slots=True)
class Reader:
    """One reader: the file that is spoiled, what it held, and what reads it in a folder."""

    name: str
    file: str
    sound: bytes
    read: Callable[[Path], object]
    beside: tuple[tuple[str, bytes], ...] = ()
    slow: bool = False

    def place(self, folder: Path, data: bytes) -> None:
        """Write the bytes, and what stands beside them, into a folder."""
        for name, content in (*self.beside, (self.file, data)):
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if name == self.file or not path.exists():
                path.write_bytes(content)


def _picture(kind: str, image: np.ndarray, **options: object) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, kind, **options)
    return buffer.getvalue()


def _pictures() -> list[Reader]:
    rng = np.random.default_rng(1)
    grey = rng.integers(0, 255, (24, 32), np.uint8)
    colour, deep = (
        rng.integers(0, 255, (24, 32, 3), np.uint8),
        rng.integers(0, 65535, (24, 32)).astype(np.uint16),
    )
    kinds = {
        "png": ("png", _picture("PNG", grey)),
        "png of 16 bits": ("png", _picture("PNG", deep)),
        "png of colours": ("png", _picture("PNG", colour)),
        "jpeg": ("jpg", _picture("JPEG", colour)),
        "progressive jpeg": ("jpg", _picture("JPEG", grey, progressive=True)),
        "tiff": ("tif", _picture("TIFF", grey)),
        "tiff, LZW": ("tif", _picture("TIFF", colour, compression="tiff_lzw")),
        "tiff, deflate, 16 bits": ("tif", _picture("TIFF", deep, compression="tiff_adobe_deflate")),
        "tiff, packbits": ("tif", _picture("TIFF", grey, compression="packbits")),
        "tiff, jpeg": ("tif", _picture("TIFF", colour, compression="jpeg")),
        "webp": ("webp", _picture("WEBP", colour)),
        "gif": ("gif", _picture("GIF", grey, save_all=True, append_images=[Image.fromarray(255 - grey)])),
        "bmp": ("bmp", _picture("BMP", grey)),
        "png of 16 bits, colours": (
            "png",
            cv2.imencode(".png", np.dstack([deep, deep // 2, deep // 3]))[1].tobytes(),
        ),
        _APART: (
            "jp2",
            cv2.imencode(".jp2", rng.integers(0, 65535, (64, 64, 3)).astype(np.uint16))[1].tobytes(),
        ),
        "jpeg 2000": ("jp2", cv2.imencode(".jp2", rng.integers(0, 255, (64, 64), np.uint8))[1].tobytes()),
    }

    def reading(file: str) -> Callable[[Path], object]:
        def read(folder: Path) -> None:
            pages = read_header(folder / file).pages
            for page in pages[:3]:
                decode(folder / file, page)

        return read

    return [
        Reader(name, f"a.{end}", data, reading(f"a.{end}"), slow=name == _APART)
        for name, (end, data) in kinds.items()
    ]


def _logs(sound: bytes) -> list[Reader]:
    text = "\n".join(sound.decode().splitlines()[:80]) + "\n"
    dated = ["Zeit;Weg;M1;M2", "[s];[mm];[Nm];[Nm]"]
    dated += [f"03.04.2024 10:00:{k % 60:02d};{k},5;0,{k};-0,25" for k in range(60)]
    columns = LogColumns()
    german = LogColumns(time_s="Zeit", displacement_mm="Weg", moment_upper_Nm="M1", moment_lower_Nm="M2")
    dialects = {
        "log": (text, columns),
        "log, semicolons": (text.replace(",", ";").replace(".", ","), columns),
        "log, tabs, quotes": (text.replace(",", "\t").replace("time_s", '"time_s"'), columns),
        "log, dates, units": ("\r\n".join(dated), german),
    }
    readers = [
        Reader(name, "a.csv", body.encode(), lambda f, told=told: read_log(f / "a.csv", told))
        for name, (body, told) in dialects.items()
    ]
    wide = text.encode("utf-16")
    return [
        *readers,
        Reader("log, UTF-16", "a.csv", wide, lambda f: read_log(f / "a.csv", columns)),
        *_tdms(columns),
    ]


def _tdms(columns: LogColumns) -> list[Reader]:
    try:
        from nptdms import ChannelObject, TdmsWriter
    except ImportError:
        return []
    buffer = io.BytesIO()
    names = ("time_s", "displacement_mm", "moment_upper_Nm", "moment_lower_Nm")
    with TdmsWriter(buffer) as writer:
        writer.write_segment(
            [ChannelObject("log", n, np.arange(20.0) * (k + 1)) for k, n in enumerate(names)]
        )
    return [Reader("log, TDMS", "a.tdms", buffer.getvalue(), lambda f: read_log(f / "a.tdms", columns))]


def _results(folder: Path, names: tuple[str, ...]) -> list[Reader]:
    files = {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    files = {name: data for name, data in files.items() if not name.startswith(".") and name != "report.html"}
    beside = tuple(files.items())
    return [
        Reader(
            f"result {name}",
            name,
            files[name],
            read_results,
            tuple(b for b in beside if b[0] != name),
            slow=True,
        )
        for name in names
        if name in files
    ]


def all_readers() -> list[Reader]:
    """Every reader with its sound file."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "sound"
        make_sound(folder)
        results = process(folder).results
        files = [
            p
            for p in folder.rglob("*")
            if p.is_file() and "truth" not in p.parts and "results" not in p.parts
        ]
        beside = tuple(
            (p.relative_to(folder).as_posix(), p.read_bytes()) for p in files if p.name != "test.toml"
        )
        told = (
            "run.json",
            "metrics.json",
            "calibration.json",
            "force.csv",
            "tracks.nc",
            "layers.csv",
            "surface.csv",
        )
        return [
            Reader("test.toml", "test.toml", (folder / "test.toml").read_bytes(), load_scene, beside),
            Reader("photos.csv", "photos.csv", _TIMES, lambda f: table_times(f / "photos.csv", _NAMES)),
            Reader("known loads", "a.csv", _TABLE, lambda f: read_table(f / "a.csv", "a.csv", g_m_s2=9.81)),
            Reader(
                "calibration.json",
                "calibration.json",
                (results / "calibration.json").read_bytes(),
                lambda f: read_calibration(f / "calibration.json"),
            ),
            *_logs((folder / "loadcells.csv").read_bytes()),
            *_pictures(),
            *_results(results, told),
        ]
