"""Sound files of every reader, spoiled byte by byte from a seed: a reader may refuse, it may not fail.

python benchmarks/fuzz_readers.py --minutes 10 --seed 1 [--keep FOLDER]

Only a PloughvalError is an answer. Any other error, more than ten seconds for one file, or more memory than
the limit is a crash: its bytes are kept and its seed is told, so that it can be made a test.
"""

import argparse
import json
import logging
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from broken.seeds import Reader, all_readers
from ploughval.errors import PloughvalError

LIMIT_BYTES = 4 << 30
SECONDS = 10
_SELDOM = 20  # a result folder takes a second, a process a third: they are read once in so many turns
_TOKENS = (
    b"",
    b"\0",
    b"\xff\xfe",
    b"\xef\xbb\xbf",
    b"\n",
    b"\r",
    b'"',
    b",",
    b";",
    b"nan",
    b"inf",
    b"-1e308",
    b"1e300",
    b"9" * 400,
    b"\xff\xff\xff\xff",
    b"\x7f\xff\xff\xff",
    b"[[[[",
    b"{}",
    b"null",
    b"true",
    b"../",
    b"\xe2\x80\xa8",
)


@dataclass(slots=True)
class Count:
    """How often a reader answered in each way, and how long it took."""

    sound: int = 0
    refused: int = 0
    longest_s: float = 0.0
    crashes: list[str] = field(default_factory=list)


def spoiled(data: bytes, rng: np.random.Generator) -> bytes:
    """The bytes with one to a few changes: flipped, cut, doubled, moved, or another's token put in."""
    changed = bytearray(data)
    for _ in range(int(rng.choice([1, 1, 1, 2, 3, 8]))):
        size = len(changed)
        place = int(rng.integers(0, size + 1))
        if rng.random() < 0.3:
            place = min(place, int(rng.integers(0, 200)))  # headers are where the faults are
        length = int(rng.choice([1, 2, 4, 8, 64, 1000]))
        kind = int(rng.integers(0, 8))
        if kind == 0 and size:
            changed[min(place, size - 1)] ^= 1 << int(rng.integers(0, 8))
        elif kind == 1 and size:
            changed[min(place, size - 1)] = int(rng.choice([0, 1, 0x7F, 0x80, 0xFF]))
        elif kind == 2:
            del changed[place : place + length]
        elif kind == 3:
            changed[place:place] = changed[place : place + length]
        elif kind == 4:
            changed[place:place] = _TOKENS[int(rng.integers(0, len(_TOKENS)))]
        elif kind == 5:
            token = _TOKENS[int(rng.integers(0, len(_TOKENS)))]
            changed[place : place + len(token)] = token
        elif kind == 6:
            del changed[place:]
        else:
            changed[place : place + length] = rng.bytes(length)
    return bytes(changed)


@contextmanager
def within(seconds: int) -> Iterator[None]:
    """TimeoutError where the block takes longer."""

    def stop(number: int, frame: object) -> None:
        raise TimeoutError(f"takes more than {seconds} s")

    signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)


def attempt(reader: Reader, data: bytes, folder: Path, count: Count) -> bool:
    """Let a reader read the bytes; False where it failed."""
    reader.place(folder, data)
    start = time.perf_counter()
    try:
        with within(SECONDS):
            reader.read(folder)
        count.sound += 1
    except PloughvalError:
        count.refused += 1
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            raise
        place = traceback.extract_tb(error.__traceback__)[-1]
        count.crashes.append(
            f"{type(error).__name__}: {str(error)[:120]} at {Path(place.filename).name}:{place.lineno}"
        )
        return False
    finally:
        count.longest_s = max(count.longest_s, time.perf_counter() - start)
    return True


def fuzz(
    readers: Sequence[Reader], seconds: float, seed: int, keep: Path, say: Callable[[str], None]
) -> dict[str, Count]:
    """Spoil and read, each reader in turn, until the time is up."""
    counts = {reader.name: Count() for reader in readers}
    end, turn = time.perf_counter() + seconds, 0
    with tempfile.TemporaryDirectory() as scratch:
        while time.perf_counter() < end:
            for number, reader in enumerate(readers):
                if reader.slow and turn % _SELDOM:
                    continue
                rng = np.random.default_rng([seed, turn, number])
                data = spoiled(reader.sound, rng)
                folder = Path(scratch) / reader.name
                if not attempt(reader, data, folder, counts[reader.name]):
                    kept = keep / f"{reader.name}-{seed}-{turn}{Path(reader.file).suffix}"
                    keep.mkdir(parents=True, exist_ok=True)
                    kept.write_bytes(data)
                    say(f"CRASH {kept}: {counts[reader.name].crashes[-1]}")
            turn += 1
    return counts


def main(arguments: Sequence[str] | None = None) -> int:
    """Fuzz for some minutes and print how each reader answered; 1 where one failed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="readers whose names hold this")
    parser.add_argument("--keep", type=Path, default=Path("fuzz-crashes"), help="where bytes of crashes go")
    options = parser.parse_args(arguments)
    resource.setrlimit(resource.RLIMIT_AS, (LIMIT_BYTES, LIMIT_BYTES))
    logging.disable()  # decoders log every fault that they meet
    readers = [reader for reader in all_readers() if options.only in reader.name]
    counts = fuzz(
        readers, 60 * options.minutes, options.seed, options.keep, lambda text: print(text, flush=True)
    )
    for name, count in counts.items():
        print(
            f"{name:24s} {count.sound:7d} read {count.refused:7d} refused {len(count.crashes):4d} crashed "
            f"longest {count.longest_s:.2f} s"
        )
    crashed = sum(len(count.crashes) for count in counts.values())
    total = sum(count.sound + count.refused for count in counts.values()) + crashed
    peak_MB = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({"files": total, "crashed": crashed, "peak_MB": round(peak_MB), "seed": options.seed}))
    return int(crashed > 0)


if __name__ == "__main__":
    sys.exit(main())
