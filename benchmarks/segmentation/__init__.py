"""How the network of `contour/segmentation/` was taught: `python -m benchmarks.segmentation.teach --help`.

It needs PyTorch, which nothing else does and no requirement names: `pip install torch`, `onnx` beside it.
"""
