"""The words of a report for derivatives, statuses and methods, and its format of numbers.

Sections and tables take every symbol, unit and number from here, so that all reports write them alike.
"""
