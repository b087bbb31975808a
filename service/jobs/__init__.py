"""Triggers in, settled jobs out, one at a time; and frames in, what a job now would come to out, live. Used by
`daemon`, `web` and `cli`.
"""
