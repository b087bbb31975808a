"""Pictures and true outlines beside them in; how well the outlines traced agree with them out, as figures and a report.
Used by `cli`.
"""
