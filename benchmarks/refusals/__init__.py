"""What the service refuses of pictures without a whole block and of traceable ones, and what the checking costs."""
