"""Force histories: their curves, peaks, scalars, and measured against predicted."""
