"""A frame and a recipe in, a measured contour in millimetres out; and the files of calibrations and tables. Used by
`link`, `records`, `jobs`, `web` and the commands.
"""
