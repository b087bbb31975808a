"""Picture, trace and polygon in, the verdict out: accepted, or refused with a reason. Used by the service only."""
