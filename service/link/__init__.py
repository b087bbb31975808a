"""Messages in, the controller's word out: the connection, whose it is, and the transfer of one job. Used by `records`,
`jobs`, `daemon` and `web`.
"""
