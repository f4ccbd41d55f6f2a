"""Picture files to samples: every format, one grey rule."""
