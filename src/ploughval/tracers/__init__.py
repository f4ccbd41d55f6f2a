"""ploughval.tracers."""
