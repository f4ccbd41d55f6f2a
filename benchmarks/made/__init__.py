"""Rigs and cameras known exactly."""
