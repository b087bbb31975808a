"""Blocks as somebody else draws them, who knew nothing of `contour.synthetic` or of what traces them: pictures to teach
and to judge with that do not share our own mistakes.
"""
