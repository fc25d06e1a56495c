"""Basics that know no robot: errors and exit codes, units, geometry, text, the registry of seams."""
