"""Friction mobilised on the bands, without running the model: docs/theory-mobilised.md."""

from ploughval.compare.mobilised.frames import mobilised_table

__all__ = ["mobilised_table"]
