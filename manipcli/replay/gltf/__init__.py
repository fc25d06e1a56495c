"""Runs and models as glTF 2.0 binary files, for Blender and Foxglove."""
