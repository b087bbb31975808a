"""A contour in pixels and the cell pitch in, out what of its outline is too narrow to be told from a chip, a strip or a
cable at the block. Numbers only, no picture. Used by `acceptance`.
"""
