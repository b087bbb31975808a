"""What cells tell a broker in; one read-only page and REST interface over all of them out.
A process of its own, which no cell depends on; it knows what Sparkplug carries and nothing of a daemon. Used by `cli`.
"""
