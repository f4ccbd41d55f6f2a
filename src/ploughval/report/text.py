"""Numbers and names as people read them: significant digits of an uncertainty, units, labels."""

import math
import re

MISSING = "–"
_POWER = " × 10"
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_UNIT_NAMES = {
    "degree": "°",
    "deg": "°",
    "1": "",
    "N m": "N m",
    "mm^2": "mm²",
    "kN/m^3": "kN/m³",
    "mm2": "mm²",
    "kN_m3": "kN/m³",
    "P0": "P₀",
}
_ENDINGS = (
    "_P0",
    "_percent",
    "_per_depth",
    "_d",
    "_kN_m3",
    "_N_m",
    "_Nm",
    "_mm2",
    "_mm",
    "_deg",
    "_mJ",
    "_px",
    "_N",
    "_s",
)
_WORDS = {"u": "u", "std": "standard uncertainty", "rms": "RMS", "P0": "P₀", "beta": "β", "phi": "φ"}


def number(value: float | None, digits: int = 4) -> str:
    """A number to so many significant digits, without powers of ten where that can be helped.

    >>> number(1234.56), number(0.00012345), number(None), number(float("nan"))
    ('1235', '0.0001234', '–', '–')
    >>> number(-4e-6, 3), number(1.5e9, 2)
    ('−4.00 × 10⁻⁶', '1.5 × 10⁹')
    """
    if value is None or not math.isfinite(value):
        return MISSING
    if value == 0:
        return "0"
    size = math.floor(math.log10(abs(value)))
    if size < -5 or size > 8:
        return _power(value, digits)
    return _minus(f"{value:.{max(0, digits - 1 - size)}f}")


def brief(value: float | None, digits: int = 4) -> str:
    """A number without digits that say nothing.

    >>> brief(0.05), brief(18.0), brief(11.30993), brief(-1234567.0)
    ('0.05', '18', '11.31', '−1234567')
    """
    text = number(value, digits)
    return text.rstrip("0").rstrip(".") if "." in text and _POWER not in text else text


def with_std(value: float | None, std: float | None) -> str:
    """A value and its standard uncertainty, both to the second digit of the uncertainty.

    >>> with_std(12.34567, 0.0234), with_std(54.35, None), with_std(None, 0.1), with_std(-1871.3, 40.2)
    ('12.346 ± 0.023', '54.35', '–', '−1871 ± 40')
    """
    if value is None or not math.isfinite(value):
        return MISSING
    if std is None or not math.isfinite(std) or std <= 0:
        return brief(value)
    places = max(0, 1 - math.floor(math.log10(std)))
    if places > 9:
        return f"{number(value, 6)} ± {number(std, 2)}"
    return _minus(f"{value:.{places}f} ± {std:.{places}f}")


def with_limit(value: float | None, limit: float | None) -> str:
    """A value to the second digit of the limit that it is held against, one digit at least.

    >>> with_limit(-4.2e-5, 0.272), with_limit(0.0861, 0.313), with_limit(-1.234e-6, 0.002)
    ('0.00', '0.09', '0.0000')
    >>> with_limit(-254.1, 1.26), with_limit(1667.0, 38.7), with_limit(0.0184, None)
    ('−254.1', '1667', '0.0184')
    """
    if value is None or limit is None or not (math.isfinite(value) and math.isfinite(limit) and limit > 0):
        return number(value, 3)
    places = max(0, 1 - math.floor(math.log10(limit)))
    return number(value, 3) if places > 9 else _minus(f"{value:z.{places}f}")


def unit(name: str) -> str:
    """A unit as it is printed.

    >>> unit("degree"), unit("mm"), unit("1")
    ('°', 'mm', '')
    """
    return _UNIT_NAMES.get(name, name)


def label(name: str) -> str:
    """A column or metric name as words, without its unit.

    >>> label("first_peak_N"), label("outcrop_x_mm"), label("area_validation_P0")
    ('First peak', 'Outcrop x', 'Area validation')
    """
    for ending in _ENDINGS:
        if name.endswith(ending) and len(name) > len(ending):
            name = name.removesuffix(ending)
            break
    words = [_WORDS.get(word, word) for word in re.split(r"[_\s]+", name) if word]
    text = " ".join(words)
    return text if words[:1] in (["β"], ["φ"], ["u"]) else text[:1].upper() + text[1:]


def slug(name: str) -> str:
    """A name as an id of the page: letters, digits and dashes.

    >>> slug("Band 1 / β")
    'band-1'
    """
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or "x"


def _power(value: float, digits: int) -> str:
    """A number as so many digits and a power of ten."""
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return _minus(mantissa) + _POWER + str(int(exponent)).translate(_RAISED)


def _minus(text: str) -> str:
    return text.replace("-", "−")
