"""Layer ``view``: flights in 3-D and against time in the viewer Rerun, recorded or live.

``runs`` turns a bag, a folder of a command, or messages of a running identifier into a ``scene``: plain arrays that say
what is shown, by name and unit. ``recording`` writes scenes into Rerun's recordings and ``layout`` arranges them on
the screen; these two alone import Rerun (``rerun-sdk``, ``requirements/view.txt``), and only when they are called.
"""
