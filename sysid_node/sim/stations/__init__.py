"""The stations of the chain: each composes its effects, and works on scalars as on whole time series."""
