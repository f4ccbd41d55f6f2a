"""The files of a result folder: what they are called, what their columns mean, and how they are read."""
