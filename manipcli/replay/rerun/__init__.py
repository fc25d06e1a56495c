"""A run in the viewer Rerun: recordings in its format `.rrd`, and the viewer on them. Needs the extra `rerun`."""
