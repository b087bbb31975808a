"""Walls of a block → the part of it that a seam parts from the rest, where two blocks lie against each other. Tracing
asks for it.
"""
