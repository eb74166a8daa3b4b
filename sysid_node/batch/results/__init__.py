"""What a batch method returns, and how it is checked.

``estimate`` is one parameter with its interval, ``response`` a model's response beside the measurement, and
``batch_fit`` the whole outcome; ``parameter_track`` holds estimates over time. ``identifiability`` says which
parameters a flight does not distinguish, and ``validation`` computes figures of merit on flights held out.
"""
