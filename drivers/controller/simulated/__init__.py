"""A scenario and a client's requests in, replies and a verdict on the client out: the cutting machine's side, played.
Used by the service and by tests.
"""
