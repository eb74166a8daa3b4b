"""What reports are made of: plain data, and how it follows from a replay or a batch identification.

``RunResult`` holds a run of an estimator, ``ManoeuvreResult`` a designed manoeuvre. ``from_replay`` makes a run's
result from aligned samples and estimates; ``comparison`` holds an estimate against the aircraft file and the truth.
"""
