"""Records, objectives and figures of the study of the fit."""
