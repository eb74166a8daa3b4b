"""What a batch method returns, and how it is checked.

``result`` holds estimates with their intervals, ``identifiability`` says which parameters a flight cannot tell apart.
``validation`` computes figures of merit on flights held out. ``identify`` hands both to the command.
"""
