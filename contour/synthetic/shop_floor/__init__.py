"""Puts what lies about on a shop floor into a scene: scene and places in, factors and light out. For the renderer."""
