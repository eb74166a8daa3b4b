"""The files of an identification, live, replayed or by a batch method.

``run_folder`` writes ``summary.json``, the CSV tables and ``report.html`` from a ``RunResult``, and reads them for
``sysid report``. Estimates and faults also become bags, which ``ros2 bag play`` shows as if they were live.
"""
