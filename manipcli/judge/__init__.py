"""Judges a run from its recording alone."""
