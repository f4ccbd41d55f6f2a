"""Tests beyond this machine: folders behind URLs, and the workers of a cluster."""
