"""Runs, figures and page of the numerical study of the model."""
