"""Blocks as a fifth hand draws them, who knew of no other: a deep body of thin walls under a camera, with some thirty
things over it or beside it. A network is taught with them.
"""
