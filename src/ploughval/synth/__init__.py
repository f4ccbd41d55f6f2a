"""ploughval.synth."""
