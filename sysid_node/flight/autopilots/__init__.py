"""What other autopilots publish, as the identifier's topics.

``base`` defines an adapter, ``px4``, ``mavros`` and ``rosflight`` implement it, and ``known`` lists them. ``joints``
maps outputs to surface deflections, ``attitude`` handles quaternions, ``recorded`` reads bags of these autopilots.
The node ``adapter`` and ``sysid convert`` use them.
"""
