"""ploughval.photos."""
