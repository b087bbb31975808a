"""Picture and fitted outline in, what each stretch of the outline rests on out: what is seen, what is hidden, and by
what. Used by `tracing` and `acceptance`, and by the service for what it writes of them.
"""
