"""Sweeps: many samples of a task, what they say about its robustness, and their comparison."""
