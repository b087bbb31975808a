"""A picture in, pixels sampled, masked, counted or drawn on out: what needs pixels and knows nothing of honeycomb. Used
by all rooms but `outline` and `geometry`.
"""
