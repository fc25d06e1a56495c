"""Folders for Foxglove: a log with its meshes, and a layout."""
