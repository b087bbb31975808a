"""A block's outline and a part's, both in millimetres, in; the pose of the part with the largest least margin out, and
where it is tightest. Numbers only, no picture. Used by the service.
"""
