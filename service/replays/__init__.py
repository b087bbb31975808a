"""Archives of cells in, on disk or in a bucket; a row a job out, of what it comes to now and came to then, by many
processes or a cluster; and a report of them. Used by the command `replay`. Needs the extra combtrace[cluster].
"""
