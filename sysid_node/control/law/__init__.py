"""From set-points to joint positions, sample by sample.

The ``reference`` motion follows the set-points, the ``control_law`` follows it with the gains of the axes, and
``tracking`` watches the error that is left; ``allocation`` gives the joint positions for the controls.
"""
