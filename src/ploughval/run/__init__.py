"""ploughval.run."""
