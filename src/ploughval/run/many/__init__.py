"""Several tests on one machine: where each goes, what it needs, and the processes that work on them."""
