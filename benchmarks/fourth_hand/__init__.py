"""Blocks as a fourth hand draws them, who knew of no other: layers of depth in the light of a shop floor, with some
thirty things over them or beside them. A network is taught with them.
"""
