"""What every table of test.toml is built on: its kinds of values, and the table itself."""

from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from ploughval.errors import Fault

# strict: neither text nor true is a number, and no number is text
Positive = Annotated[float, Field(gt=0, le=1e9, allow_inf_nan=False, strict=True)]
NotNegative = Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False, strict=True)]
# ten metres: no blade and no cell of a laboratory is larger
Length = Annotated[float, Field(gt=0, le=1e4, allow_inf_nan=False, strict=True)]
Finite = Annotated[float, Field(ge=-1e12, le=1e12, allow_inf_nan=False, strict=True)]
Angle = Annotated[float, Field(gt=0, lt=90, allow_inf_nan=False, strict=True)]
Whole = Annotated[int, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]
Count = Annotated[int, Field(ge=3, le=100, strict=True)]
Pixel = tuple[Finite, Finite]


class Table(BaseModel):
    """Base of every table of test.toml: frozen, and unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=False)

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> list[Fault]:
        """What in the table's values contradicts itself; values of wrong type are passed over."""
        return []

    @model_validator(mode="after")
    def _no_conflicts(self) -> Self:
        faults = self.conflicts(vars(self))
        if faults:
            raise ValueError("; ".join(map(str, faults)))
        return self
