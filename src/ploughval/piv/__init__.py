"""ploughval.piv."""
