"""Commands that read recorded flights: what a file holds, a bag of it, the aircraft identified, the gap, a fleet.

Each writes a folder of results, of which ``report`` and ``view`` show what another command found.
"""
