"""ploughval.report."""
