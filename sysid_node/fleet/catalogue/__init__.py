"""The catalogue of a fleet: which flights there are, of which aircraft, and what was done to these.

``reading`` takes a CSV or a YAML file or a folder of logs and gives a ``catalogue.Catalogue``; patterns become files by
``locations``, which opens whatever fsspec does and copies a remote log to this machine.
"""
