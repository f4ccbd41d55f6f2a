"""Hard cases of every part, and the page of their fate."""
