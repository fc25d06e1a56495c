"""The hand of a robot, measured on its shapes: fingers, tips, how they close, the gap between them, a tool frame."""
