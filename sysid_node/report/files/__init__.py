"""The files of a run: written into the folder of ``--out``, and read back.

``run_folder`` writes ``summary.json``, the CSV tables and ``report.html`` from a ``RunResult``, and reads them for
``sysid report``. Estimates and faults also become bags, which ``ros2 bag play`` shows as if they were live.
"""
