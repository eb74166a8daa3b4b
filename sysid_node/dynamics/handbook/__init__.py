"""What an aircraft file says in a handbook's terms: trim, performance, modes of motion, control power, unusual values.

``equations`` are the aircraft's equations of motion, ``trim`` solves them for steady flight, ``modes`` linearises them
there, ``performance`` has stall, glide and climb, ``unusual`` compares with usual ranges, ``handbook`` collects all.
"""
