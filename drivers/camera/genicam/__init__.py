"""GenICam cameras, on GigE Vision and USB3 Vision, through Aravis, a library of the system that is loaded on first use.

Aravis speaks the protocols and the camera's own description of itself. What a measurement stands on is kept here:
settings that are read back, a frame that is whole and was exposed after the trigger, and a camera that has gone told
within two seconds.
"""
