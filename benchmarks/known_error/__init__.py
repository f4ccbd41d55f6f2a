"""Made tests whose error is known, and figures of it."""
