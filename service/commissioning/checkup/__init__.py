"""A configuration in, a result for each thing that can be checked of it and its machine out; a running service is not
disturbed. Used by the commands only.
"""
