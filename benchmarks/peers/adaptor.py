"""What the adaptors of all packages share: read pairs of pictures, measure, write what was found.

An adaptor runs in the package's own environment, so only numpy is used here. It is called with the files of
the pairs and a folder; the first pair is measured once beforehand, so that compiling is not timed. Seconds
are those of the processor, all threads added up, so that other work on the machine disturbs little.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SUBSET = 31
STEP = 16
MARGIN = 24


@dataclass(frozen=True)
class Found:
    """What a package measured, at its own points."""

    points: NDArray[np.float64]
    """(N, 2) px, x first, in the reference."""
    displacement: NDArray[np.float64]
    """(N, 2) px, x right and y down."""
    valid: NDArray[np.bool_]
    std: NDArray[np.float64] | None = None


Picture = NDArray[np.uint8]
Measure = Callable[[Picture, Picture], Found]


def grid(shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Points on a square grid, row by row, (N, 2) px."""
    axes = (np.arange(MARGIN, n - MARGIN, STEP, dtype=np.float64) for n in reversed(shape))
    return np.stack([axis.ravel() for axis in np.meshgrid(*axes)], axis=1)


def finite(points: NDArray[np.float64], displacement: NDArray[np.float64]) -> Found:
    """Result of a package that only says what it could not measure by leaving it out."""
    return Found(points, displacement, np.isfinite(displacement).all(axis=1))


def serve(distribution: str, measure: Measure) -> int:
    """Measure the pairs named on the command line; a pair that fails is written with the reason."""
    parser = argparse.ArgumentParser(description=f"Measures pairs of pictures with {distribution}.")
    parser.add_argument("pairs", type=Path, nargs="+")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    for number, path in enumerate(given.pairs):
        with np.load(path) as pair:
            pictures = pair["reference"], pair["current"]
        target = given.out / path.name
        try:
            if number == 0:
                measure(*pictures)
            start = time.process_time()
            found = measure(*pictures)
            seconds = time.process_time() - start
        except Exception as error:  # any fault of a package is a result here
            reason = f"{type(error).__name__}: {error}"
            np.savez(target, version=version(distribution), fault=reason[:500])
            continue
        std = np.full_like(found.displacement, np.nan) if found.std is None else found.std
        np.savez(
            target, version=version(distribution), points=found.points, displacement=found.displacement,
            valid=found.valid, std=std, seconds=seconds,
        )  # fmt: skip
    return 0
