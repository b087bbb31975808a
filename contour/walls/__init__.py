"""A picture in, `WallEvidence` out: cell walls, where they end, and which of them belong to one block. Used by
`outline`, `tracing` and `acceptance`.
"""
