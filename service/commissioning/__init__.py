"""A configuration, a controller or a scenario in; what is wrong with it and what to do, or the proof that it is right,
out: checks, tests on hardware, contours given by hand, files to install. Used by the commands only, but for
`hil`, which is for the tests of whoever has a controller.
"""
