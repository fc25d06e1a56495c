"""The verdict on a run, computed from its recording alone."""
