"""A traced outline in millimetres in, the cutting polygon out, with few vertices and inside what was traced. Used by
`acceptance` and the service.
"""
