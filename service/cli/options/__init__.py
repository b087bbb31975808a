"""Options that several commands share. Used by the commands only."""
