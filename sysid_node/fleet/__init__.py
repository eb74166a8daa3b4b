"""Layer ``fleet``: many flights of many aircraft: what each flight gives, and what they tell together.

A catalogue names the flights, the engine estimates each of them by a process of its own, and a state file in the
fleet's folder keeps what is finished. What comes back are ``results.FleetResults``, from which ``statistics`` computes
what the fleet tells.
"""
