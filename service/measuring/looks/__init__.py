"""What of a picture is looked at when a first look refuses a block, and which look's word counts."""
