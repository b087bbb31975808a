"""Accuracy and speed of the tracing methods on rendered scenes and photographs."""
