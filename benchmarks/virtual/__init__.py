"""A material-point run seen as an experiment."""
