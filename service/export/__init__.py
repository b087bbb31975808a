"""A contour as files that other programs read: DXF, SVG, GeoJSON, G-code; all in millimetres of the machine frame."""
