"""Logs written by LabVIEW as TDMS files, read through the package nptdms."""

import logging
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ploughval.errors import DataError, MissingExtraError
from ploughval.limits import LOG_BYTES, LOG_ROWS, refuse_large
from ploughval.loadcells.logs.names import VALUE_COLUMNS, Wanted, column_unit, find_places, matches
from ploughval.loadcells.logs.raw import RawLog
from ploughval.loadcells.logs.rows import FileRows
from ploughval.memory import raise_shortage

_NOT_SET = np.datetime64("1904-01-02")  # TDMS counts from 1904-01-01: a start before this was never set


def read_tdms(path: Path, wanted: Wanted) -> RawLog:
    """Read channels of a TDMS file, named as ``channel`` or ``group/channel``.

    The time is a channel, or the waveform's own: start, offset and increment of the channels. Times of a
    TDMS file are UTC. A start of the waveform that was never set counts as none.

    Parameters
    ----------
    path : Path
        The file.
    wanted : Wanted
        The channels to read.

    Returns
    -------
    RawLog

    Raises
    ------
    DataError
        The file cannot be read, a channel is missing, or lengths or increments differ.
    MissingExtraError
        Without the package nptdms.
    """
    channels = _channels(path)
    timed = bool(matches(wanted.names["time_s"], list(channels)))
    values = [name for key, name in wanted.names.items() if key in VALUE_COLUMNS]
    there = list(channels)
    waves = not timed and all(
        (k := matches(name, there)) and "wf_increment" in channels[there[k[0]]].properties for name in values
    )
    if waves:
        wanted = Wanted(wanted.names, wanted.optional | {"time_s"})
    places = find_places(there, wanted, path)
    found = {key: channels[there[k]] for key, k in places.items()}
    rows = _common_length({channel.name: len(channel) for channel in found.values()}, path)
    data = {key: _samples(channel, path) for key, channel in found.items()}
    time = data.get("time_s")
    if time is None and waves:
        time = _wave_times(found, path)
    units = {
        key: column_unit(
            key, wanted.names[key], channel.name, str(channel.properties.get("unit_string", "")), path
        )
        for key, channel in found.items()
        if key != "date"
    }
    headers = {key: channel.name for key, channel in found.items()}
    return RawLog(
        path,
        time,
        data.get("date"),
        {key: _floats(data[key], headers[key], path) for key in VALUE_COLUMNS},
        headers,
        units,
        FileRows(path.name, rows),
    )


def _common_length(lengths: dict[str, int], path: Path) -> int:
    """How many samples every channel has; refused where they are not one each a row, or too many."""
    if len(set(lengths.values())) > 1:
        shown = ", ".join(f"{name}: {count}" for name, count in lengths.items())
        raise DataError(f"channels of different lengths ({shown}); expected one sample each a row", path=path)
    rows = max(lengths.values())
    if rows > LOG_ROWS:
        raise DataError(
            f"holds more than {LOG_ROWS // 1_000_000} million samples a channel; expected at most as many. "
            "Thin it out or part it: [loadcells] log may list several files",
            path=path,
        )
    return rows


def _channels(path: Path) -> dict[str, Any]:
    """Every channel under group/name and, where no other group has one of that name, its name alone."""
    try:
        from nptdms import TdmsFile
        from nptdms.log import log_manager
    except ImportError:
        raise MissingExtraError("nptdms", "tdms", f"Reading {path}") from None
    try:
        refuse_large(path, LOG_BYTES, "Keep only the channels and the part of the test in it")
        log_manager.set_level(logging.CRITICAL + 1)  # it logs traces of its own code; the error tells enough
        file = TdmsFile.read(path)
        groups = file.groups()
    except DataError:
        raise
    except OSError as error:
        raise DataError(f"cannot be read: {error.strerror or error}", path=path) from None
    except Exception as error:  # a spoiled binary file can raise anything within that package
        raise_shortage(error, LOG_BYTES)
        raise DataError(f"cannot be read as TDMS: {type(error).__name__} {error}", path=path) from None
    every = [channel for group in groups for channel in group.channels()]
    count = Counter(channel.name for channel in every)
    channels: dict[str, Any] = {channel.name: channel for channel in every if count[channel.name] == 1}
    return channels | {f"{channel.group_name}/{channel.name}": channel for channel in every}


def _samples(channel: Any, path: Path) -> pd.Series:
    try:
        return pd.Series(np.asarray(channel[:]))
    except Exception as error:  # scaling and data types are read only now
        raise_shortage(error, LOG_BYTES)
        raise DataError(f"channel {channel.name!r} cannot be read: {error}", path=path) from None


def _floats(samples: pd.Series, name: str, path: Path) -> np.ndarray:
    if samples.dtype.kind not in "fiub":
        raise DataError(f"channel {name!r} holds {samples.dtype}; expected numbers", path=path)
    return samples.to_numpy(dtype=np.float64, copy=True)


def _wave_times(found: Mapping[str, Any], path: Path) -> pd.Series:
    """Times of the samples by the waveform's properties: date-times where its start is set, else seconds."""
    channel = found[VALUE_COLUMNS[0]]
    steps = {float(c.properties["wf_increment"]) for c in found.values()}
    offsets = {float(c.properties.get("wf_start_offset", 0.0)) for c in found.values()}
    if len(steps) > 1 or len(offsets) > 1:
        raise DataError(
            f"channels with different increments ({sorted(steps)} s) or offsets ({sorted(offsets)} s); "
            "expected one clock for all",
            path=path,
        )
    seconds = offsets.pop() + steps.pop() * np.arange(len(channel))
    start = channel.properties.get("wf_start_time")
    if start is None or np.datetime64(start, "us") < _NOT_SET or not np.isfinite(seconds).all():
        return pd.Series(seconds)
    return pd.Series(np.datetime64(start, "us") + (seconds * 1e6).round().astype("timedelta64[us]"))
