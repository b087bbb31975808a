"""Cameras calibrated from rendered pictures of a board, beside the truth: writes the page on calibration."""
