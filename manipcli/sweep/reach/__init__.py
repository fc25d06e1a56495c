"""Where an object may be so that a task can be planned up to a step: a map, planned point by point."""
