"""ploughval.model."""
