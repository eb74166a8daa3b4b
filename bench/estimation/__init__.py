"""Online estimates held against the truth or against other programs, and what the benches of this kind share."""
