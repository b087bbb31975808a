"""A configuration in, the daemon's parts out: with the device commands, the only place that names concrete drivers.

Used by `commissioning` and the commands.
"""
