"""File names of the attachments of a log, and names of its metadata."""

from __future__ import annotations

TASK, ROBOT, CONTROLLERS, URDF = "task.yaml", "robot.yaml", "controllers.yaml", "robot.urdf"
SCENE = "scene.json"
INERTIALS = "inertials"
"""The metadata record of how the inertials of links were made, by link."""
