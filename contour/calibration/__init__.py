"""A calibration and pixels in, millimetres on a plane and their uncertainty out. Used by `tracing`, `polygon`,
`acceptance`, `camera_calibration` and the service.
"""
