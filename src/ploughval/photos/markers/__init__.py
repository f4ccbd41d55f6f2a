"""Markers painted on the window: found in a photograph, and again in every one of a series."""
