"""What the daemon and its page take as processes, beside what they may take; and a day of its life."""
