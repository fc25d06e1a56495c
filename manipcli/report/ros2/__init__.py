"""Export of a robot and a plan to ROS 2: controllers, description, SRDF and goals."""
