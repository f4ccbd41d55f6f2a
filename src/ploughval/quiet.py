"""What a library logs is left out where ploughval tells it itself."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def hushed(name: str, level: int) -> Iterator[None]:
    """Without what a logger has to say below a level; not where it is asked for everything (--debug).

    Parameters
    ----------
    name : str
        Of the logger.
    level : int
        Least level that is still heard, as :data:`logging.ERROR`.
    """
    logger = logging.getLogger(name)
    before = logger.level
    if not logger.isEnabledFor(logging.DEBUG):
        logger.setLevel(level)
    try:
        yield
    finally:
        logger.setLevel(before)
