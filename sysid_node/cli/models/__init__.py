"""Commands that start from a model of the aircraft: what it says, simulated flights, manoeuvres, models elsewhere."""
