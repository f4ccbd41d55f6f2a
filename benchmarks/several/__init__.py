"""Made tests that repeat each other, and the page of their study."""
