"""Cameras of the Linux kernel's Video4Linux2, driven by its own interface: ioctl, mmap, poll.

What a library in between would hide is what a measurement stands on: when a frame was exposed, whether the driver calls
it damaged, which settings it really took, and why a read failed.
"""
