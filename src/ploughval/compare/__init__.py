"""ploughval.compare."""
