"""Another simulator's model corrected by what a diagnosis found, and flown in that simulator.

``jsbsim_model`` writes the difference of two aircraft files (before and after the diagnosis) into a copy of a JSBSim
model: ``jsbsim_servos`` into its flight control system, ``jsbsim_loads`` as increments of coefficients and thrust, and
``jsbsim_masses`` into its mass balance. ``jsbsim_flight`` flies short flights in JSBSim itself.
"""
