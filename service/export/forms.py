"""The forms of export, told without loading what makes them."""

ENDINGS = {"dxf": "dxf", "svg": "svg", "geojson": "geojson", "gcode": "ngc"}
"""Names of the forms, and the endings of their files."""
