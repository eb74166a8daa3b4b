"""How a report says things: the words for derivatives, statuses and methods, and the form of numbers.

Sections and tables take every symbol, unit and number from here, so that all reports write them alike.
"""
