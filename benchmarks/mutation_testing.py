"""Mutation testing: small changes of a module's code, one at a time, and whether its tests notice.

Needs the extra ``mutation`` (cosmic-ray). Verdicts are kept in the working folder, so that a run that was
stopped goes on. Ends with exit code 1 where a mutant survives that mutation/equivalent.csv does not explain.
"""

import argparse
import random
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from mutation.making import canaries_of, kernels_of, mutants_of
from mutation.mutant import Mutant
from mutation.page import write_compiled, write_page, write_tables
from mutation.runs import ROOT, Setting, load_libraries, path_of, verdicts
from mutation.table import Kept, judged
from mutation.targets import TARGETS, Target

LEAST_LIMIT_S = 10.0
SLOWER = 4.0  # times what the tests take of the processor on the module as it is


def base_setting(target: Target, scratch: Path, *, compiled: bool) -> Setting:
    """How mutants of a module are tested; the tests must pass on the module as it is."""
    source = path_of(target.module).read_text(encoding="utf-8")
    setting = Setting(target.module, target.tests, 600.0, compiled)
    [(_, found)] = verdicts([Mutant("none", "", 0, "", "", "", source)], setting, 1, scratch)
    if found.fate != "survived":
        raise SystemExit(f"{target.module}: its tests fail as it is: {' '.join(target.tests)}")
    return setting._replace(limit_s=max(LEAST_LIMIT_S, SLOWER * found.seconds))


def unreached(target: Target, setting: Setting, workers: int, scratch: Path) -> list[str]:
    """Functions that raise and are not noticed."""
    canaries = canaries_of(path_of(target.module).read_text(encoding="utf-8"))
    found = verdicts(canaries, setting, workers, scratch)
    return [mutant.function for mutant, verdict in found if verdict.fate == "survived"]


def fates_of(target: Target, options: argparse.Namespace, scratch: Path) -> list[tuple[Mutant, str]] | None:
    """What became of every mutant; None where the time is up before."""
    setting = base_setting(target, scratch, compiled=False)
    for name in unreached(target, setting, options.workers, scratch):
        print(f"{target.module}: no test reaches {name}", flush=True)
    tests = {ROOT / test.split("::")[0]: None for test in target.tests}
    kept = Kept(options.work / f"{target.module}.csv", [path_of(target.module), *tests])
    mutants = mutants_of(path_of(target.module).read_text(encoding="utf-8"))
    open_ones = [mutant for mutant in mutants if kept.fate(mutant, older=options.older) is None]
    for mutant, verdict in verdicts(open_ones, setting, options.workers, scratch):
        kept.add(mutant, verdict.fate)
        if verdict.fate == "survived":
            print(f"{target.module}:{mutant.line} {mutant.before}  ->  {mutant.after}", flush=True)
        if time.monotonic() > options.until:
            return None
    return [(mutant, kept.fate(mutant, older=options.older) or "") for mutant in mutants]


def compiled_rows(
    target: Target, fates: Sequence[tuple[Mutant, str]], options: argparse.Namespace, scratch: Path
) -> list[list[str]]:
    """Mutants of kernels drawn at random, tested anew with compiled kernels; their fates both times."""
    kernels = kernels_of(path_of(target.module).read_text(encoding="utf-8"))
    open_ones = [pair for pair in fates if pair[0].function in kernels and pair[1] != "timed out"]
    drawn = random.Random(0).sample(open_ones, min(options.compiled, len(open_ones)))
    if not drawn:
        return []
    setting = base_setting(target, scratch, compiled=True)
    again = dict(verdicts([mutant for mutant, _ in drawn], setting, options.workers, scratch))
    return [
        [target.module, str(mutant.line), mutant.before, mutant.after, fate, again[mutant].fate]
        for mutant, fate in drawn
    ]


def main(argv: Sequence[str] | None = None) -> int:
    """Test the mutants of the modules named, and write the tables and the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", choices=[[], *TARGETS], help="of modules; all of them by default")
    parser.add_argument("--out", type=Path, default=ROOT / "reports" / "mutation")
    parser.add_argument("--work", type=Path, default=ROOT / "build" / "mutation", help="verdicts so far")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument(
        "--minutes", type=float, default=600.0, help="stop after this time; go on another time"
    )
    parser.add_argument("--older", action="store_true", help="since the kills on file tests were only added")
    parser.add_argument(
        "--compiled", type=int, default=0, help="mutants tested with compiled kernels as well"
    )
    options = parser.parse_args(argv)
    options.until = time.monotonic() + 60.0 * options.minutes
    options.work.mkdir(parents=True, exist_ok=True)
    survivors = 0
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        load_libraries(scratch)
        for name in options.names or TARGETS:
            fates = fates_of(TARGETS[name], options, scratch)
            if fates is None:
                print("the time is up: run the same command again")
                return 2
            judgements = judged(TARGETS[name].module, fates)
            survivors += sum(fate == "surviving" for _, fate in judgements)
            write_tables(options.out, TARGETS[name].module, judgements)
            if options.compiled:
                rows = compiled_rows(TARGETS[name], fates, options, scratch)
                write_compiled(options.out, TARGETS[name].module, rows)
    write_page(options.out)
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
