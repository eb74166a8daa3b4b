"""The four pages: of a run, of a gap's diagnosis, of a manoeuvre, and of a closed-loop flight.

Each lists its sections; ``render`` fills their templates and joins them with style, script and plotly.js in one file.
"""
