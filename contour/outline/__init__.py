"""`RingEvidence` in, the outline with its uncertainty out: lines, arcs and free curves fitted to wall ends; it never
sees a picture. Used by `tracing`.
"""
