"""Layer ``cli``: what a person runs. One module a command; ``main`` finds and calls it."""
