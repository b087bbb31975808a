"""Commands that make and check a calibration: `board`, `calibrate`, `align`, `verify`, `repeat`."""
