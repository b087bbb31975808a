"""A gauge's place in pixels and a calibration in; errors of length and form with their budget, what is still missing,
and a verdict, out. Used by the service.
"""
