"""Where a material-point run lies that may not be copied into the project."""

import os
from pathlib import Path

_FORCE = "mpm_d30_s2_force.csv"


def virtual_folder() -> Path | None:
    """Folder of the run, beside the repository or where PLOUGHVAL_SHARED says; None where it is not."""
    given = os.environ.get("PLOUGHVAL_SHARED")
    shared = Path(given) if given else Path(__file__).resolve().parents[3] / "shared"
    return shared / "virtual" if (shared / "virtual" / _FORCE).is_file() else None
