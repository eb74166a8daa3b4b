"""What the nodes share.

``spin`` runs a program, ``lifecycle`` and ``loop_node`` are the nodes' base classes, and ``declaring`` declares their
parameters. ``message_types`` and ``conversion`` stand between ROS's messages and plain numbers, ``diagnostics`` writes
the identifier's /diagnostics, and ``simulated_flight`` is the simulator's node. ``follower`` and ``loop_watch`` listen
to running nodes for the command line.
"""
