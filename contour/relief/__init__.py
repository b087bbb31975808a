"""A picture and the table that was taught → how a block stands out of it, and where its walls end, by their tops and
the sides below. Used by `walls`, `tracing` and the service.
"""
