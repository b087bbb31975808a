"""Which pixels are walls, comb, and things over it, as a small convolutional network tells that learnt it from
rendered blocks on tables of all kinds. Comes in: a picture; goes out: a picture of its comb on black. Used by the
service, where the picture itself shows no outline. It is trained in `benchmarks/segmentation/`.
"""
