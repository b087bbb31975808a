"""Files in, checked settings out, or mistakes with their lines. Used by all rooms of the service above it."""
