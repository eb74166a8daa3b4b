"""Layer ``cli``: the commands of ``sysid``, one module each; ``main`` finds and runs them.

A command parses its arguments, calls the functions of the layers below and prints what they found. ``shared`` holds the
options and the terminal output that several commands have in common; ``live`` what the commands that start nodes need.
"""
