"""Layer ``report``: the files that a command leaves, among them one HTML page that needs no network.

A command's outcome becomes a result (``results``); ``files`` writes it as JSON, CSV, bags and the page, and reads runs
back. ``pages`` lists each report's ``sections``, which fill the templates with sentences (``wording``) and figures
(``drawing``).
"""
