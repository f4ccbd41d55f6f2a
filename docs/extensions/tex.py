"""TeX to MathML by latex2mathml, which passes over what it does not know and spaces functions as letters."""

import re

from latex2mathml.converter import convert

_SIDES = {"l": r"\left", "r": r"\right"}
_SIZED = re.compile(r"\\[bB]igg?([lr])(?![A-Za-z])")
"""Brackets of a stated size: browsers do not enlarge one that has an exponent, and so would part a pair."""
TAG = re.compile(r"\s*\\tag\{([^{}]+)\}")
_FUNCTION = re.compile(r"<(m[io])>([a-z]{2,})</\1>(?=(<mo stretchy=\"false\">&#x00028;)?)")
_OPENED = re.compile(r"(?:<mrow>|<mtd[^>]*>|(?<!&#x00029;)(?<![)\]|])</mo>)(?:<m\w+>)*\Z")
"""What stands before a function that needs no space: an opening, or an operator with a space of its own."""
_BAR = re.compile(r"<mo(?: stretchy=\"false\")?>(&#x0007C;|&#x02016;)</mo>")
_PRIME = re.compile(r"<msup>(<(mi|mtext)[^>]*>[^<]+</\2>)<mi>&#x02032;</mi></msup>")
_SIGN = re.compile(r"<mi>(&#x0007E;|&#x000B1;|;)</mi>")
"""Signs that latex2mathml takes for letters, so that no space is left about them; the first is of \\sim."""
_WORD = re.compile(r"(?:<mi mathvariant=\"normal\">\w</mi>){2,}")
_PAIRS = ((r"(?<!\\)\{", r"(?<!\\)\}"), (r"\\left\b", r"\\right\b"), (r"\\begin\b", r"\\end\b"))
"""What opens and closes in TeX; latex2mathml closes silently what is left open."""
_UNKNOWN = re.compile(r"\\[A-Za-z]+")
"""A command in the MathML: latex2mathml copies those that it does not know."""


def mathml(tex: str, *, block: bool) -> str:
    r"""MathML of TeX without its tag.

    Names of functions are given the thin spaces that TeX has about them, bars none; words are one piece.
    Primes are as large as the letter: as superscripts they nearly vanish.

    Raises
    ------
    ValueError
        When the TeX holds a command that is not known, or does not close.
    """
    tex = _SIZED.sub(lambda side: _SIDES[side[1]], TAG.sub("", tex))
    for opens, closes in _PAIRS:
        if len(re.findall(opens, tex)) != len(re.findall(closes, tex)):
            raise ValueError(f"{opens} and {closes} are not as many")
    try:
        markup = convert(tex, display="block" if block else "inline")
    except Exception as fault:  # of a dozen kinds, none of them documented
        raise ValueError(f"{type(fault).__name__} {fault}") from fault
    if unknown := _UNKNOWN.search(markup):
        raise ValueError(f"{unknown[0]} is not known")
    for pattern, better in (
        (_FUNCTION, _spaced),
        (_BAR, _closed_up),
        (_PRIME, _primed),
        (_SIGN, _sign),
        (_WORD, _joined),
    ):
        markup = pattern.sub(better, markup)
    return markup


def _closed_up(bar: re.Match[str]) -> str:
    return f'<mo lspace="0" rspace="0" stretchy="false">{bar[1]}</mo>'


def _primed(letter: re.Match[str]) -> str:
    return f'<mrow>{letter[1]}<mo lspace="0" rspace="0">&#x02032;</mo></mrow>'


def _sign(sign: re.Match[str]) -> str:
    return f"<mo>{sign[1].replace('&#x0007E;', '&#x0223C;')}</mo>"


def _joined(letters: re.Match[str]) -> str:
    return f"<mi>{''.join(re.findall('>(.)<', letters[0]))}</mi>"


def _spaced(function: re.Match[str]) -> str:
    before = "0" if _OPENED.search(function.string, 0, function.start()) else "0.17em"
    after = "0" if function[3] else "0.17em"
    return f'<mo form="prefix" lspace="{before}" rspace="{after}">{function[2]}</mo>'
