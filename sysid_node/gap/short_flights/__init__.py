"""Short flights: the simulator beside a flight, started again every two seconds from the measured state.

``multiple_shooting`` flies them, ``readings`` compares what they read with what was measured. ``selection`` asks by how
much a candidate changes their error, ``validation`` measures the gap by it.
"""
