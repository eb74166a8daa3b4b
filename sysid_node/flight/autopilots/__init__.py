"""Other autopilots' topics, converted to the topics that the identifier listens to.

``base`` defines an adapter, ``px4``, ``mavros`` and ``rosflight`` implement it, and ``known`` lists them. ``joints``
maps outputs to surface deflections, ``attitude`` has quaternions, and ``recorded`` reads bags of these autopilots. The
node ``adapter`` and ``sysid convert`` use an adapter message by message.
"""
