"""Pictures and true outlines beside them in; how well the outlines traced agree with them out, as figures and a report.
The page on which true outlines are drawn, too. Used by `cli`.
"""
