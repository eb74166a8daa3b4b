"""The blocks of an aircraft file, one module each: every value is checked where it is read.

``quantities`` reads a number that may have a tolerance, ``body`` mass, geometry, sensors and noise, ``controls`` the
controls and the throttle, ``derivatives`` the derivatives, ``effects`` the effects and delays, and ``tables`` the
lookup tables. ``load`` puts them together.
"""
