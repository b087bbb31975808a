"""The live view: what the camera sees between jobs, for all who watch."""
