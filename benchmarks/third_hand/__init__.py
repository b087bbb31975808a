"""Blocks as a third hand draws them, who knew of no other: a field of heights under one or two lamps, with some thirty
things over it or beside it. A network is taught with them.
"""
