"""Pictures of a board, of the empty table or of fixed marks, and points jogged to, in; what their files are to hold,
and what was refused, out. Used by the commands and the page.
"""
