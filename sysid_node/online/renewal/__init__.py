"""Renewal of what changes slowly, with every half second of data, in steps between the samples.

``segment_update`` says what is due. It measures the present segment (``segment_information``), solves for the estimates
and their covariances (``segment_solution``, by ``solved_equations``), moves the servos (``servo_steps``,
``servo_search``), and looks for changes of the aircraft (``change_response``). ``pending_renewal`` makes the steps.
"""
