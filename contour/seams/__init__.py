"""Walls of a block → the part of it that a seam parts from the rest, where two blocks lie against each other; a block
and what is flat → what joins it to another piece of comb. Tracing asks for both.
"""
