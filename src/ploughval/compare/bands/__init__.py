"""Shear bands: measured matched to predicted, and the scalars that describe them."""
