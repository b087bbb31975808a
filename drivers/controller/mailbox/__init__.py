"""Blocks and contours in, registers out, and back: the one place that knows the mailbox's layout. Used by `modbus`, and
by the service.
"""
