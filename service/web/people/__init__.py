"""Who gives orders by a short PIN, how often it may be guessed, and who of them has the word."""
