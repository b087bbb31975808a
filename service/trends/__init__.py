"""A journal in; how measuring fared over hours, days and years out, as figures, as a page and as a shift's report.
Used by `daemon`, which keeps what jobs alone do not tell, by `web` and the commands.
"""
