"""Layer ``faults``: which surface, sensor or part of the airframe has failed, by how much and since when.

``watch`` takes the messages. It compares positions with commands, finds silent topics and passes aligned samples on to
``monitor``, which compares them with a reference model (``model``) and weighs ``hypotheses`` of what has failed.
``report`` turns the most probable one into a ``types.Fault``. ``recorded_flight`` does the same for a recording.
"""
