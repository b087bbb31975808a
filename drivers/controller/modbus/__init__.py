"""Requests in, judged replies out, over TCP, RTU and RTU over TCP; one attempt a call. Used by the service."""
