"""Changes of the aircraft in flight, found by tests on recent data.

``score_test`` tests whether a stretch of flight contradicts the estimates from before it, and ``detection`` decides
whether it is an abrupt change. ``excited_segments`` keeps the well-excited stretches that the estimates rest on. The
estimator forgets what came before a change.
"""
