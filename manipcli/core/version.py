"""The version of manipcli."""

__version__ = "0.1.0"
