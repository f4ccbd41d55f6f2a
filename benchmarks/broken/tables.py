"""Broken folders: empty-box runs, files that calibrate, binary logs, and tables of times."""

import struct

import numpy as np

from broken.base import Case, Spoil, changed, rows, setting, together, written
from broken.logs import MEASURED, PHOTOS, cells

_RUN = "empty/run1.csv"


def _empty_runs() -> list[Case]:
    def run(name: str, spoil: Spoil, *told: str, codes: tuple[int, ...] = (1,)) -> Case:
        return Case(f"empty run: {name}", spoil, told, codes, MEASURED)

    left = ("empty-box run left out", "run1.csv")
    both = together(written(_RUN, b""), written("empty/run2.csv", b""))
    fast = cells(lambda k, row: [row[0], str(float(row[1]) * 3), *row[2:]])
    against = cells(lambda k, row: [row[0], str(-float(row[1])), *row[2:]])
    longer = cells(lambda k, row: [row[0], str(float(row[1]) * (1 + k / 99)), *row[2:]])
    return [
        run("zero bytes", written(_RUN, b""), *left, "no row of numbers"),
        run("no rows", rows(_RUN, lambda x: x[:1]), *left, "no row of numbers"),
        run("one row", rows(_RUN, lambda x: x[:2]), *left),
        run(
            "other columns",
            changed(_RUN, lambda d: d.replace(b"moment_upper_Nm", b"F1")),
            *left,
            "moment_upper_Nm",
        ),
        run("a text", written(_RUN, "to be done\n"), *left),
        run("binary", written(_RUN, np.random.default_rng(4).bytes(9000)), *left),
        run("all of zero bytes", both, *left, "none of the empty-box runs"),
        run("no motion", rows(_RUN, lambda x: x[:20]), "run1.csv", "no motion", codes=(0, 1)),
        run("shorter", rows(_RUN, lambda x: x[:80]), "run1.csv", "travels", codes=(0,)),
        run("longer", rows(_RUN, longer), "run1.csv", codes=(0,)),
        run("faster", rows(_RUN, fast), "run1.csv", "speed", codes=(0,)),
        run("the other way", rows(_RUN, against), "run1.csv", "against", codes=(0, 1)),
        run("without rest", rows(_RUN, lambda x: [x[0], *x[45:]]), "run1.csv", "no rest", codes=(0,)),
    ]


def _calibrations() -> list[Case]:
    """Calibration of the cells by a table, and of the camera by an earlier file."""
    table = "known.csv"
    sound = "load_N,arm_mm,upper,lower\n0,0,0,0\n5,0,1,0.6\n10,0,2,1.2\n5,0,1,0.6\n0,0,0,0\n"
    given = setting("loadcells.calibration.files", f'["{table}"]')

    def cell(name: str, text: bytes | str, *told: str, codes: tuple[int, ...] = (1,)) -> Case:
        return Case(f"calibration: {name}", together(given, written(table, text)), told, codes, PHOTOS)

    camera = setting("camera.calibration", '"calibration.json"')
    alone = together(camera, setting("camera.mm_per_px", ""), setting("camera.tip_px", ""))

    def earlier(name: str, data: bytes | str, *told: str) -> Case:
        spoil = together(alone, written("calibration.json", data))
        return Case(f"calibration: earlier, {name}", spoil, ("calibration.json", *told))

    return [
        cell("zero bytes", b"", table),
        cell("headers alone", sound.split("\n")[0] + "\n", table),
        cell("a column missing", sound.replace("upper", "up"), table, "no column", "upper"),
        cell("a word for a number", sound.replace("10,0,2", "10,0,two"), table, "two"),
        cell("binary", bytes(range(256)) * 9, table),
        cell("infinite loads", sound.replace("10,", "inf,"), table),
        cell("loads that are all zero", sound.replace("5,", "0,").replace("10,", "0,"), "load"),
        cell(
            "readings that never change",
            "load_N,arm_mm,upper,lower\n0,0,1,1\n5,0,1,1\n9,0,1,1\n",
            "calibration",
        ),
        cell("1e300", sound.replace("10,0,2", "1e300,0,2"), table),
        cell(
            "a direction of its own",
            "load_N,arm_mm,upper,lower,direction\n0,0,0,0,up\n5,0,1,1,left\n",
            "left",
            "up or down",
        ),
        earlier("zero bytes", b"", "JSON"),
        earlier("no object", "[1, 2]", "version"),
        earlier("binary", bytes(range(256)), "JSON"),
        earlier("another version", '{"version": 99}', "version", "99"),
        earlier("keys missing", '{"version": 1}', "ploughval process"),
        earlier("brackets without end", "[" * 100_000, "JSON"),
        earlier("NaN", '{"version": 1, "mm_per_px": NaN}', "ploughval process"),
        earlier("20 MB", '{"version": 1, "method": "' + "x" * 20_000_000 + '"}', "MB"),
        Case("calibration: board of zero bytes", _board(b""), ("board.png", "0 bytes")),
        Case("calibration: board that shows none", _board(_PLAIN), ("board.png", "board")),
    ]


_PLAIN = b"P5 40 40 255 " + bytes(1600)


def _board(data: bytes) -> Spoil:
    table = '\n[camera.board]\nkind = "chessboard"\npicture = "board.png"\n'
    table += "columns = 7\nrows = 5\nspacing_mm = 5.0\n"
    return together(
        setting("camera.mm_per_px", ""),
        changed("test.toml", lambda d: d + table.encode()),
        written("board.png", data),
    )


def _tdms() -> list[Case]:
    """Binary logs of LabVIEW: lead-ins that say anything."""
    named = setting("loadcells.log", '"log.tdms"')

    def lead(size: int, *, body: bytes = b"", toc: int = 0x0E) -> bytes:
        return b"TDSm" + struct.pack("<IIQQ", toc, 4713, size, len(body)) + body

    bodies = {
        "zero bytes": b"",
        "a text": b"time_s,force\n1,2\n",
        "a lead-in of 2^60 bytes": lead(2**60),
        "2^31 objects": lead(99, body=struct.pack("<I", 2**31 - 1)),
        "a name of 2^31 letters": lead(99, body=struct.pack("<II", 1, 2**31 - 1)),
        "random bytes": lead(9000, body=np.random.default_rng(6).bytes(9000)),
        "cut off": lead(9000)[:15],
        "no channels": lead(0, body=struct.pack("<I", 0)),
    }
    return [
        Case(f"log: TDMS, {what}", together(written("log.tdms", data), named), ("log.tdms",), (1,), PHOTOS)
        for what, data in bodies.items()
    ]


def _tables_of_times() -> list[Case]:
    table, told = "photos.csv", ("photos.csv",)

    def times(name: str, spoil: Spoil, *more: str) -> Case:
        return Case(f"times: {name}", spoil, (*told, *more))

    return [
        times("zero bytes", written(table, b""), "file and time_s"),
        times("headers alone", rows(table, lambda x: x[:1]), "names none"),
        times("other columns", rows(table, lambda x: ["name,t", *x[1:]]), "file and time_s"),
        times("a word for a time", changed(table, lambda d: d.replace(b"8.0", b"noon")), "line 4", "noon"),
        times("nan", changed(table, lambda d: d.replace(b"8.0", b"nan")), "line 4", "nan"),
        times("infinite", changed(table, lambda d: d.replace(b"8.0", b"-inf")), "line 4", "inf"),
        times("1e300", changed(table, lambda d: d.replace(b"8.0", b"1e300")), "line 4", "1e300"),
        times("all the same", changed(table, lambda d: d.replace(b"8.0", b"6.0")), "same time", "0001.png"),
        times("a photograph twice", changed(table, lambda d: d.replace(b"0002", b"0001")), "more than once"),
        times("UTF-16", changed(table, lambda d: d.decode().encode("utf-16")), "UTF-8"),
        times("binary", written(table, bytes(range(256))), "photos.csv"),
        times("NUL bytes", changed(table, lambda d: d + bytes(99)), "photos.csv"),
        times(
            "one cell of 1 MB", changed(table, lambda d: d + b'"' + b"x" * 1_000_000 + b'",3\n'), "photos.csv"
        ),
        times("a quote that is not closed", changed(table, lambda d: d + b'"0009.png,3\n'), "photos.csv"),
        times("20 MB", changed(table, lambda d: d + b"a.png,3\n" * 2_500_000), "MB"),
        times("names of other photographs", changed(table, lambda d: d.replace(b"000", b"9")), "names none"),
        Case(
            "times: backwards",
            changed(table, lambda d: d.replace(b"8.0", b"5.0")),
            ("order",),
            (0, 1),
            MEASURED,
        ),
        Case(
            "times: exif where there is none", setting("camera.times", '"exif"'), ("DateTimeOriginal", "CSV")
        ),
        Case("times: video where there is none", setting("camera.times", '"video"'), ("video",)),
        Case(
            "times: an interval of nan",
            setting("camera.times", "{start_s = nan, interval_s = 0}"),
            ("camera.times",),
        ),
        Case(
            "times: a row missing",
            rows(table, lambda x: [*x[:3], x[4]]),
            ("frame", "has no row in photos.csv"),
            (1,),
            MEASURED,
        ),
    ]


def cases() -> list[Case]:
    """All of them."""
    return [*_tdms(), *_empty_runs(), *_calibrations(), *_tables_of_times()]
