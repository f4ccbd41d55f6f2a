"""Broken test folders: what each is, what must be said of it, and how it is judged; sound files to spoil."""
