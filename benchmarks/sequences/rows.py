"""One measured figure and the figure to reach."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Row:
    """One figure; ``least`` and ``most`` bound the figure to reach where there is one."""

    quantity: str
    value: float
    unit: str
    least: float | None = None
    most: float | None = None

    @property
    def label(self) -> str:
        """Quantity and unit."""
        return f"{self.quantity} [{self.unit}]"

    @property
    def reached(self) -> bool | None:
        """Whether the figure is reached; None without one; a value that could not be had is not."""
        if self.least is None and self.most is None:
            return None
        low = -np.inf if self.least is None else self.least
        high = np.inf if self.most is None else self.most
        return bool(low <= self.value <= high)


def rms(values: NDArray[np.float64]) -> float:
    """Root of the mean square; NaN of nothing."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else float("nan")


def side_by_side(tables: Mapping[str, Sequence[Row]]) -> pd.DataFrame:
    """Figures as rows, folders as columns, the figure to reach in front."""
    labels = list(dict.fromkeys(row.label for rows in tables.values() for row in rows))
    limits = {row.label: bound(row) for rows in tables.values() for row in rows}
    columns = {name: {row.label: row.value for row in rows} for name, rows in tables.items()}
    table = pd.DataFrame(columns).reindex(labels)
    table.insert(0, "to reach", [limits[label] for label in labels])
    return table


def missed(rows: Sequence[Row]) -> list[str]:
    """Figures that were not reached, each with its value."""
    return [f"{row.label} = {row.value:.4g} ({bound(row)})" for row in rows if row.reached is False]


def bound(row: Row) -> str:
    """The figure to reach in words."""
    if row.least is not None and row.most is not None:
        return f"{row.least:g} to {row.most:g}"
    if row.most is not None:
        return f"at most {row.most:g}"
    return "" if row.least is None else f"at least {row.least:g}"
