"""Tracer layers and free surface: measured lines against predicted ones."""
