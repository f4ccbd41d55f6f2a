"""Peak, residual and mobilization length from mobilised friction: docs/theory-mobilised.md, section 4."""
