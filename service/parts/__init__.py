"""Files of parts in; their outlines in millimetres, checked, or what is wrong with them and where, out. Used by
`measuring`, the wiring and the commands.
"""
