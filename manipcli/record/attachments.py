"""Names of the files that a log carries as attachments."""

from __future__ import annotations

TASK, ROBOT, CONTROLLERS, URDF = "task.yaml", "robot.yaml", "controllers.yaml", "robot.urdf"
SCENE = "scene.json"
