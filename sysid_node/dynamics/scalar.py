"""Elementary functions of single numbers under NumPy's names: ten times as fast as NumPy's own on a number."""

from math import atan2 as arctan2
from math import cos, exp, hypot, log, log1p, sin, sqrt, tan

__all__ = ["arctan2", "cos", "exp", "hypot", "log", "log1p", "sin", "sqrt", "tan"]
