"""Real flights against the numbers that the field's own programs give for them."""
