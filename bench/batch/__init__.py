"""The methods of `sysid identify`: coverage of their intervals, published analyses, all methods side by side."""
