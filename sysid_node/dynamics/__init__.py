"""Layer ``dynamics``: the physics of flight, each equation once, for one sample, for NumPy's arrays and for JAX's.

``coefficients`` turns the motion into regressors and these into coefficients, ``forces`` coefficients into forces and
moments and back, and ``rigid_body`` these into accelerations; ``airflow``, ``attitude`` and ``lever_arm`` hold the
kinematics, ``linear_model`` the linear equations about level flight. The simulator, the estimators, the controller and
the diagnosis call these functions.

Body axes forward-right-down, SI and radians. A quantity is a number or an array of any shape (``Real``), three
components are a ``Vector``. Functions that need sines or roots take their library as the last argument ``xp``:
``numpy``, ``jax.numpy``, or ``sysid_node.dynamics.scalar`` for single numbers.
"""
