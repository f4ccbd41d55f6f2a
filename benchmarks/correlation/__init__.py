"""Exact pictures of sand with a known motion, and figures of the correlation."""
