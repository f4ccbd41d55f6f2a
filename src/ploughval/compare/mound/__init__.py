"""The mound ahead of the blade: its height, front, slope and area, measured and predicted."""
