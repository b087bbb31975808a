"""Views of a board or measured points in, a calibration and a verdict on it out. Used by the service."""
