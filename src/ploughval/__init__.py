"""ploughval."""
