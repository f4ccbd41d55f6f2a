"""Chapters, figures and sentences of the page of speed against error."""
