"""Measurements of a recording beyond its verdict: tracking errors, limits, work, grasps, steps."""
