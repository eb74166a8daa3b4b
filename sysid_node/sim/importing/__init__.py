"""Other simulators' models as aircraft files: the reverse of ``export``.

A reader for each format (``jsbsim``, ``gazebo``, ``rosflight``) evaluates the model's loads in any state; ``expansion``
turns them into derivatives and tables about a level flight, and the result is ``imported.Imported``: an aircraft and
what of the model its file cannot hold. ``plant`` is what the readers of written-down equations have in common.
"""
