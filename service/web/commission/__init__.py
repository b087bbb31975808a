"""Requests of whoever sets a cell up in; the files that the commands write, and how each step stands, out."""
