"""Members: bounds on the timing of a path."""
