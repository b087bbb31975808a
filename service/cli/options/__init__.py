"""Options that several commands share: how they are named, and what they stand for. Used by the commands only."""
