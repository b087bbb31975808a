"""Jobs and their evidence in, the journal and the archive out, and replays of them. Used by `jobs`, `daemon`, `web` and
the commands.
"""
