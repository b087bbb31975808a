"""Programs that draw what is shipped or shown: sample frames, views of a board, the picture of one contour's way."""
