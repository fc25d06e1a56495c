"""File names of the attachments of a log."""

from __future__ import annotations

TASK, ROBOT, CONTROLLERS, URDF = "task.yaml", "robot.yaml", "controllers.yaml", "robot.urdf"
SCENE = "scene.json"
