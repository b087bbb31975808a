"""Rings and segments in, rings, distances and comparisons out: plane geometry without pictures. Every room of `contour`
uses it.
"""
