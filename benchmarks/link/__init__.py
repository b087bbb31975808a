"""How fast a contour goes out and how soon a lost link is back, beside the programs of others."""
