"""Made tests of whole sequences, their errors against exact truth, and figures."""
