"""Systematic errors: what is taken as known of aircraft and instruments, and what its tolerances do to the estimates.

``sources`` lists the imperfections that an aircraft may have within its tolerances, and ``source_changes`` what each
changes in the transformed signals (``column_changes``). ``servo_model`` is how late the controls follow;
``cross_spectra`` changes what is summed up of the flight by it. ``consider`` estimates the imperfections along with the
derivatives, as far as the flight tells of them, and gives the derivatives' corrections and systematic variances;
``budget`` says what these are made of.
"""
