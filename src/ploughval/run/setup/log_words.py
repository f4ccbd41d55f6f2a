"""Columns of a log recognised by their words, in several languages, and by their units."""

import re
import unicodedata
from types import MappingProxyType

from ploughval.loadcells.logs.units import counts_samples, named_unit, unit_factor

WANTED = ("time_s", "displacement_mm", "moment_upper_Nm", "moment_lower_Nm")
_KINDS = MappingProxyType(dict(zip(WANTED, ("time", "length", "moment", "moment"), strict=True)))
# English, German, French, Spanish, Italian, Dutch; accents are taken off before
_WORDS = MappingProxyType(
    {
        "time_s": r"time|timestamp|datetime|elapsed|t|zeit|temps|tiempo|tempo|tijd",
        "displacement_mm": r"displacement|disp|travel|stroke|position|lvdt|u|weg|hub|verschiebung|"
        r"deplacement|course|desplazamiento|recorrido|spostamento|corsa|verplaatsing",
        "moment_upper_Nm": r"upper|up|top|high|oben|obere|oberer|oberes|haut|superieure?|superiore?|sup|"
        r"boven|arriba|alto",
        "moment_lower_Nm": r"lower|low|bottom|unten|untere|unterer|unteres|bas|inferieure?|inferiore?|inf|"
        r"onder|abajo|basso",
    }
)
_BRIDGE = re.compile(r"(?i)\s*[mµμu]?V\s*/\s*V\s*")  # a bridge that is not calibrated yet
_OTHER_UNITS = re.compile(r"ms|us|s|min|h|m|cm|mm|um|in|inch|v|mv|n|kn|kg|g|hz|bit")


def guess_columns(names: tuple[str, ...]) -> dict[str, str]:
    """Which of a log's columns are time, displacement and the two moments; only what is clear.

    A name counts by one of its words, if its unit, where it tells one, is of the right kind. Without a time,
    a column that counts samples stands for it.

    >>> guess_columns(("Zeit (ms)", "Weg [mm]", "M oben", "M unten"))["moment_upper_Nm"]
    'M oben'
    """
    found: dict[str, str] = {}
    for wanted, words in _WORDS.items():
        exact = [n for n in names if n == wanted]
        similar = [n for n in names if _is_meant(n, words, _KINDS[wanted])]
        choice = exact or similar
        if len(choice) == 1 and choice[0] not in found.values():
            found[wanted] = choice[0]
    counts = [n for n in names if counts_samples(n, "")]
    if "time_s" not in found and len(counts) == 1:
        found = {"time_s": counts[0], **found}
    return found


def words_of(name: str) -> list[str]:
    """The words of a name in lower case, without accents."""
    plain = unicodedata.normalize("NFKD", name)
    plain = "".join(sign for sign in plain if not unicodedata.combining(sign))
    return [word for word in re.split(r"[\W_]+", plain.casefold()) if word]


def _is_meant(name: str, words: str, kind: str) -> bool:
    parts = words_of(name)
    if not any(re.fullmatch(words, part) for part in parts):
        return False
    unit = named_unit(name, kind)
    if unit:
        return unit_factor(unit, kind) is not None or (kind == "moment" and bool(_BRIDGE.fullmatch(unit)))
    return not any(_OTHER_UNITS.fullmatch(part) for part in parts[1:])
