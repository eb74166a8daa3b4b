"""The diagnosis of the gap: each effect, withheld effects, real flights, its calibration and its thresholds."""
