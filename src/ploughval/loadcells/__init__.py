"""ploughval.loadcells."""
