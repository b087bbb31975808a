"""Picture and fitted outline in, what each stretch of the outline rests on out: what is seen, what is hidden, and by
what; the same along the polygon made of it. Used by `tracing` and `acceptance`.
"""
