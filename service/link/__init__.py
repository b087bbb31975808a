"""Messages in, the controller's word out: the connection, whose it is, and the transfer of one job.

Used by every room above it: records, jobs, daemon, web, wiring, commissioning and the commands.
"""
