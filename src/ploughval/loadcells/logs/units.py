"""Units in the headers of logs: what a name, a bracket or a row of units says, and the factor to ours."""

import re
from types import MappingProxyType

SAMPLE = "sample"  # the unit of a column that counts samples

_LENGTH = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "dm": 100.0, "m": 1e3, "in": 25.4, "inch": 25.4, '"': 25.4}
_MOMENT = {
    "Nmm": 1e-3,
    "Ncm": 1e-2,
    "Nm": 1.0,
    "kNmm": 1.0,
    "kNcm": 10.0,
    "kNm": 1e3,
    "mNm": 1e-3,
    "MNm": 1e6,
}
_SECONDS = {
    "ns": 1e-9,
    **dict.fromkeys(("us", "microseconds"), 1e-6),
    **dict.fromkeys(("ms", "msec", "millis", "milliseconds"), 1e-3),
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds", "sek", "sekunden"), 1.0),
    **dict.fromkeys(("min", "mins", "minute", "minutes", "minuten"), 60.0),
    **dict.fromkeys(("h", "hr", "hrs", "hour", "hours", "std"), 3600.0),
    **dict.fromkeys(("d", "day", "days"), 86400.0),
}
_SAMPLES = frozenset({"sample", "samples", "sample number", "scan", "scans", "#", "index", "row"})
FACTORS = MappingProxyType({"time": _SECONDS, "length": _LENGTH, "moment": _MOMENT})
OURS = MappingProxyType({"time": "s", "length": "mm", "moment": "N m"})
_BRACKET = re.compile(r"(?P<stem>.*?)\s*[\[(<](?P<unit>[^\[\]()<>]*)[\])>]\s*", re.DOTALL)
_SLASH = re.compile(r"(?P<stem>.+?)(?:\s*/\s*|\s+in\s+)(?P<unit>[^/]+)", re.DOTALL)


def stem_and_unit(name: str) -> tuple[str, str]:
    """A header's name without the unit at its end, in brackets or after a slash; an empty unit for none.

    >>> stem_and_unit("M upper (N mm)"), stem_and_unit("time_s")
    (('M upper', 'N mm'), ('time_s', ''))
    """
    found = _BRACKET.fullmatch(name)
    if found:
        return found["stem"].strip(), found["unit"].strip()
    found = _SLASH.fullmatch(name)
    if found and any(unit_factor(found["unit"], kind) is not None for kind in FACTORS):
        return found["stem"].strip(), found["unit"].strip()
    return name.strip(), ""


def unit_factor(unit: str, kind: str) -> float | None:
    """How many of our units (s, mm, N m) one of these is; None for a unit that is not known.

    >>> unit_factor("kN m", "moment"), unit_factor("µm", "length"), unit_factor("mV/V", "moment")
    (1000.0, 0.001, None)
    """
    plain = re.sub(r"[\s·*.⋅×-]", "", unit).replace("µ", "u").replace("μ", "u")
    known = FACTORS[kind]
    if plain in known:
        return known[plain]
    # N MM is no other unit than N mm; but mNm and MNm differ by their case alone.
    folded = [factor for name, factor in known.items() if name.casefold() == plain.casefold()]
    return folded[0] if len(set(folded)) == 1 else None


def named_unit(name: str, kind: str) -> str:
    """The unit that a header's name tells: in brackets, after a slash, or as its last words; '' for none.

    >>> [named_unit(n, "moment") for n in ("M [kNm]", "M1 / N cm", "moment_upper_Nm", "M_upper")]
    ['kNm', 'N cm', 'Nm', '']
    """
    stem, unit = stem_and_unit(name)
    if unit:
        return unit
    words = [word for word in re.split(r"[_\s]+", stem) if word]
    for last in (words[-2:], words[-1:]):
        told = len(last) < len(words) or (kind == "time" and len(stem) > 1)
        if told and last and unit_factor(" ".join(last), kind) is not None:
            return " ".join(last)
    return ""


def counts_samples(name: str, unit: str) -> bool:
    """Whether a column of times is one of sample numbers, by its unit or its own name."""
    return (unit or stem_and_unit(name)[0]).casefold().replace("_", " ") in _SAMPLES
