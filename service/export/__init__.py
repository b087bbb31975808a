"""A contour in, files that other programs read out: DXF, SVG, GeoJSON, G-code, all in millimetres of the machine frame.
Used by `records`, `web`, `commissioning`, the wiring and the commands.
"""
