"""A table of rows in; what it comes to out: figures, conditions, and a page with pictures. Used by the command."""
