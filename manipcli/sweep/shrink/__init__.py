"""The smallest change from the task as written under which it fails."""
