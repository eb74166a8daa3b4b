"""sysid: aerodynamic identification of fixed-wing aircraft, in flight and at the desk."""

__version__ = "0.1.0"
