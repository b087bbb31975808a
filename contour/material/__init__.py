"""Picture and cell pitch → the outline around all that is no table, of closed cells and foam. Tracing asks for it."""
