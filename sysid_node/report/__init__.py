"""Layer ``report``: one self-contained HTML page and plain CSV tables from the results of a run.

``write_run(folder, run)`` writes everything, ``read_run(folder)`` reads it back, ``write_report(path, run)``
draws the page. A run is a ``RunResult`` (``sysid_node.report.data``).
"""
