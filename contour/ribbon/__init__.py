"""A picture and its block's outline in; the direction of the core's ribbon in millimetres out, where the picture tells
it. Used by the service.
"""
