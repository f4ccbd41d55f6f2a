"""Small changes of a module's code, made one at a time, and whether its tests notice."""
