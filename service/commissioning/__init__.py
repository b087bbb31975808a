"""A configuration or a controller in, proof or what is wrong with it out: checks, probes, tests on hardware, given
contours. Used by the commands only.
"""
