"""Checks of a task before its run: gains, efforts, grasps and timeouts, one check per file."""
