"""A log as a table, put in order and judged."""

import numpy as np
import pytest

from ploughval.loadcells.logs.checks import check_columns


@pytest.fixture(scope="session")
def check_table():
    """Checks a table, which is kept: what can be used of it, and its faults."""

    def check(table):
        return check_columns({name: table[name].to_numpy(dtype=np.float64, copy=True) for name in table})

    return check
