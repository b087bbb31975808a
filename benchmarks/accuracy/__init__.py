"""How near every method comes to rendered scenes and photographs, and how fast: writes the page on accuracy."""
