"""Adaptive control: failures in flight, stress, and the way back to the fixed gains."""
