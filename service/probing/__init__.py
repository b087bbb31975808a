"""A connected controller in, what it can do and what to change in the configuration out. Used by the commands and the
page.
"""
