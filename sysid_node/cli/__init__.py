"""Layer ``cli``: the commands of ``sysid``, one module each; ``main`` finds and runs them.

A command parses its arguments, calls the functions of the layers below and prints what they found. Those of ``flights``
read recorded flights, those of ``models`` need no flight but a model of the aircraft, and those of ``live`` run nodes.
``shared`` holds the options and the terminal output that several commands have in common.
"""
