"""From px to mm and back: plane, lens and window in one mapping, with its uncertainty."""
