"""A picture and a recipe in; the contour, in millimetres where there is a calibration, and what speaks against it out.
And the files that it is measured by: calibrations with their reports, tables, points, masters, trends. Of the other
rooms it uses `config` alone; all but that may use it.
"""
