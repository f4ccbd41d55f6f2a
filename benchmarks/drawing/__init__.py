"""The one look of the studies' figures, and pictures and pages made small."""
