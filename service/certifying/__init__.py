"""Pictures of a gauge and its file in; what is missing, and a certificate of the cell, out. Used by `accept`."""
