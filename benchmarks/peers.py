"""Other packages on the same exact pictures: speed against error, one row a package.

Each package gets an environment of its own and a process of its own, on one core. What cannot be installed or
run gets a row that says so.
"""

import argparse
import os
import re
import shutil
import statistics
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path

import numpy as np

from correlation.cases import SEED, Case, Metrics, all_cases, make_pair, score
from speed_error.tables import write_rows

ADAPTORS = Path(__file__).resolve().parent / "peers"
TIMED = "shift 0.25 noise 3"
"""Case whose time is taken, once a round."""
COMPARED = "al-dic-local"
"""Package that the speeds are compared with."""
PATIENCE_S = 1200
ONE_THREAD = {
    f"{library}_NUM_THREADS": "1"
    for library in ("OMP", "NUMBA", "OPENBLAS", "MKL", "RAYON", "NUMEXPR")
} | {"MPLBACKEND": "Agg", "QT_QPA_PLATFORM": "offscreen"}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Peer:
    """A package, or one way of using it."""

    name: str
    adaptor: str
    requirement: str = ""
    """What pip installs; empty: the environment of this script."""
    python: str = ""
    """Version of Python that the package needs; empty: any."""
    note: str = ""
    """What the reader of its row has to know."""

    @property
    def distribution(self) -> str:
        """Name of the package without its version."""
        return self.requirement.partition("==")[0]


PEERS = (
    Peer("ploughval", "run_ploughval"),
    Peer("al-dic-local", "run_al_dic_local", "al-dic==1.0.3"),
    Peer("al-dic-admm", "run_al_dic_admm", "al-dic==1.0.3"),
    Peer("pyvale", "run_pyvale", "pyvale==2026.10.2", python="3.13"),
    Peer("sun-dic", "run_sun_dic", "SUN-DIC==0.0.35"),
    Peer(
        "geopyv-dev",
        "run_geopyv_dev",
        "geopyv-dev==0.2.2",
        note="subsets one by one, the first started by a phase correlation of ours",
    ),
    Peer("openpiv", "run_openpiv", "OpenPIV==0.26.1", note="windows of 32 px, passes 128, 64 and four of 32"),
    Peer("opencv-dis-fine", "run_opencv_dis_fine"),
    Peer("opencv-dis-medium", "run_opencv_dis_medium"),
)


@dataclass(slots=True)
class Outcome:
    """What is known of a package after the runs."""

    peer: Peer
    version: str = ""
    scores: dict[str, Metrics] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)
    points: int = 0
    seconds: list[float] = field(default_factory=list)

    @property
    def points_s(self) -> float:
        """Points per second of one core: the median round; NaN without one."""
        return self.points / statistics.median(self.seconds) if self.seconds else float("nan")


class PeerError(Exception):
    """A package could not be installed or run."""


def find_python(peer: Peer, python: str, python313: str) -> str:
    """Interpreter for a package's environment."""
    if not peer.python:
        return python
    found = python313 or shutil.which(f"python{peer.python}")
    if not found:
        raise PeerError(f"needs Python {peer.python}: none given with --python313, none in the search path")
    return found


def environment(peer: Peer, work: Path, python: str, python313: str) -> str:
    """Interpreter with the package installed; made when it is not there yet."""
    if not peer.requirement:
        return sys.executable
    folder = work / f"venv-{peer.distribution.lower()}"
    interpreter = folder / ("Scripts" if os.name == "nt" else "bin") / "python"
    if not installed(interpreter, peer):
        call([find_python(peer, python, python313), "-m", "venv", str(folder)])
        call([str(interpreter), "-m", "pip", "install", "--quiet", peer.requirement])
    return str(interpreter)


def installed(interpreter: Path, peer: Peer) -> bool:
    """Whether an environment holds the wanted version of the package."""
    if not interpreter.exists():
        return False
    asked = f"from importlib.metadata import version; print(version({peer.distribution!r}))"
    answer = subprocess.run([interpreter, "-c", asked], capture_output=True, text=True, check=False)
    return answer.stdout.strip() == peer.requirement.partition("==")[2]


def call(command: Sequence[str]) -> None:
    """Run a command; its last words are the message when it fails."""
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=PATIENCE_S, check=False,
            env=os.environ | ONE_THREAD, errors="replace",
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as error:
        raise PeerError(str(error)[:300]) from error
    if done.returncode != 0:
        words = [line for line in (done.stderr or done.stdout).splitlines() if line.strip()]
        raise PeerError(f"ended with {done.returncode}: {' '.join(words[-2:])[:300]}")


def one_core() -> list[str]:
    """Command that keeps what follows on a single core, where there is one."""
    if shutil.which("taskset") is None or not hasattr(os, "sched_getaffinity"):
        return []
    return ["taskset", "-c", str(max(os.sched_getaffinity(0)))]


def file_of(case_name: str) -> str:
    """File name of a case."""
    return re.sub(r"[^\w.]+", "-", case_name) + ".npz"


def write_pairs(cases: Sequence[Case], folder: Path, seed: int) -> None:
    """Write the two pictures of every case."""
    folder.mkdir(parents=True, exist_ok=True)
    for case in cases:
        reference, current = make_pair(case, seed)
        np.savez(folder / file_of(case.name), reference=reference, current=current)


def run_adaptor(peer: Peer, interpreter: str, names: Sequence[str], work: Path) -> Path:
    """Measure cases with a package in a process of its own; folder of what it wrote."""
    out = work / f"found-{peer.name}"
    shutil.rmtree(out, ignore_errors=True)
    pairs = [str(work / "pairs" / file_of(name)) for name in names]
    script = str(ADAPTORS / f"{peer.adaptor}.py")
    call([*one_core(), interpreter, script, *pairs, "--out", str(out)])
    return out


def take(outcome: Outcome, folder: Path, cases: Sequence[Case], seed: int) -> None:
    """Score what an adaptor wrote."""
    for case in cases:
        path = folder / file_of(case.name)
        if not path.exists():
            outcome.faults.append(f"{case.name}: nothing written")
            continue
        with np.load(path) as found:
            outcome.version = str(found["version"])
            if "fault" in found:
                outcome.faults.append(f"{case.name}: {first_words(str(found['fault']))}")
                continue
            std = found["std"] if np.isfinite(found["std"]).any() else None
            outcome.scores[case.name] = score(
                case, found["points"], found["displacement"], found["valid"], std, seed=seed
            )
            if outcome.scores[case.name].valid == 0:
                outcome.faults.append(f"{case.name}: no valid vector")
            if case.name == TIMED:
                outcome.points = len(found["points"])
                outcome.seconds.append(float(found["seconds"]))


def first_words(text: str) -> str:
    """First line of a message, cut."""
    return (text.strip().splitlines() or [""])[0][:120]


def measure_all(
    peers: Sequence[Peer], cases: Sequence[Case], work: Path, rounds: int, seed: int, pythons: tuple[str, str]
) -> list[Outcome]:
    """All cases in the first round, the timed one alone in further rounds, packages taking turns."""
    outcomes = [Outcome(peer) for peer in peers]
    interpreters: dict[str, str] = {}
    timed = [case for case in cases if case.name == TIMED]
    rest = [case for case in cases if case.name != TIMED]
    for number in range(rounds):
        chosen = [*timed, *rest] if number == 0 else timed
        for outcome in outcomes:
            peer = outcome.peer
            if number and not outcome.seconds:
                continue
            print(f"round {number + 1} of {rounds}: {peer.name}", file=sys.stderr, flush=True)
            try:
                if peer.name not in interpreters:
                    interpreters[peer.name] = environment(peer, work, *pythons)
                folder = run_adaptor(peer, interpreters[peer.name], [c.name for c in chosen], work)
                take(outcome, folder, chosen, seed)
            except PeerError as error:
                outcome.faults.append(str(error))
    return outcomes


def get(outcome: Outcome, case: str, metric: str) -> float:
    """A metric of a case; NaN where it was not measured."""
    scores = outcome.scores.get(case)
    return float("nan") if scores is None else float(getattr(scores, metric))


def sweep(outcome: Outcome, noise: str, metric: str) -> list[float]:
    """A metric over the translations at one noise; NaN alone when none was measured."""
    names = [name for name in outcome.scores if re.fullmatch(rf"shift .* noise {noise}", name)]
    return [get(outcome, name, metric) for name in names] or [float("nan")]


def text(value: float, digits: int) -> str:
    """Number as text; a dash for what was not measured."""
    return "-" if np.isnan(value) else f"{value:.{digits}f}"


def row_of(outcome: Outcome, compared: float) -> dict[str, str]:
    """Row of the table, as text; what a package could not do is in words in the last column."""

    def of(case: str, metric: str, digits: int) -> str:
        return text(get(outcome, case, metric), digits)

    far, hard, turn = "far 60 px", "hard", "rotation 15 deg"
    wide, narrow = "band 12 px tanh", "band 4 px tanh"
    return {
        "package": outcome.peer.name,
        "version": outcome.version or "-",
        "bias_0": text(max(sweep(outcome, "0", "bias_px")), 4),
        "bias_3": text(max(sweep(outcome, "3", "bias_px")), 4),
        "x_bound": text(statistics.fmean(sweep(outcome, "3", "times_bound")), 2),
        "affine_rmse": of("affine", "rmse_px", 4),
        "affine_p99": of("affine", "p99_px", 3),
        "light_rmse": of("light", "rmse_px", 4),
        "hard_rmse": of(hard, "rmse_px", 3),
        "hard_valid": of(hard, "valid", 3),
        "near_12": of(wide, "near_rmse_px", 2),
        "near_12_valid": of(wide, "near_valid", 2),
        "near_4": of(narrow, "near_rmse_px", 2),
        "near_4_valid": of(narrow, "near_valid", 2),
        "star_90": of("star", "star_period_px", 0),
        "far60_rmse": of(far, "rmse_px", 4),
        "far60_valid": of(far, "valid", 2),
        "turn15_rmse": of(turn, "rmse_px", 4),
        "turn15_valid": of(turn, "valid", 2),
        "points_s": text(outcome.points_s, 0),
        "ratio": text(outcome.points_s / compared, 2),
        "remark": "; ".join(filter(None, [outcome.peer.note, *outcome.faults])),
    }


def write_tables(outcomes: Sequence[Outcome], out: Path) -> list[dict[str, str]]:
    """Write peers.csv, and peers-cases.csv with every metric of every case; rows of the first."""
    reference = next((o.points_s for o in outcomes if o.peer.name == COMPARED), float("nan"))
    rows = [row_of(outcome, reference) for outcome in outcomes]
    write_rows(out / "peers.csv", list(rows[0]), rows)
    names = ["package", "case", *(f.name for f in fields(Metrics))]
    scores = [
        {"package": outcome.peer.name, "case": case}
        | {name: f"{value:.6g}" for name, value in asdict(metrics).items()}
        for outcome in outcomes
        for case, metrics in outcome.scores.items()
    ]
    write_rows(out / "peers-cases.csv", names, scores)
    return rows


def print_table(rows: Sequence[dict[str, str]]) -> None:
    """Print the rows; remarks below."""
    names = [name for name in rows[0] if name != "remark"]
    widths = [max(len(name), *(len(row[name]) for row in rows)) for name in names]
    for row in (dict(zip(names, names, strict=True)), *rows):
        print(f"{row['package']:{widths[0]}}", end="  ")
        print("  ".join(f"{row[name]:>{w}}" for name, w in zip(names[1:], widths[1:], strict=True)))
    for row in rows:
        if row["remark"]:
            print(f"{row['package']}: {row['remark']}")


def chosen_peers(only: str) -> list[Peer]:
    """Packages whose name begins with one of the given words; all without any."""
    words = [word for word in only.split(",") if word]
    return [peer for peer in PEERS if not words or any(peer.name.startswith(word) for word in words)]


def main(arguments: list[str] | None = None) -> int:
    """Measure, print the table and write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, required=True, help="folder for environments and pictures")
    parser.add_argument("--only", default="", help="beginnings of names, with commas: al-dic,opencv-dis")
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    parser.add_argument("--rounds", type=int, default=5, help="how often the time is taken")
    parser.add_argument("--seed", type=int, default=SEED, help="of the pictures")
    parser.add_argument("--python", default=sys.executable, help="interpreter for the environments")
    parser.add_argument("--python313", default="", help="interpreter for packages that need Python 3.13")
    given = parser.parse_args(arguments)
    peers = chosen_peers(given.only)
    if not peers:
        parser.error(f"--only: none of {', '.join(peer.name for peer in PEERS)}")
    work, cases = given.work.resolve(), all_cases()
    write_pairs(cases, work / "pairs", given.seed)
    pythons = (given.python, given.python313)
    outcomes = measure_all(peers, cases, work, given.rounds, given.seed, pythons)
    print_table(write_tables(outcomes, given.out))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
