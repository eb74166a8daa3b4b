"""The check of ``sysid gap --simulator``: a user's JSBSim model, and a reality that is the same with a withheld effect.

Reality is made by other means than the correction: servos and lost effect by changing the commands on their way to
JSBSim, coefficients, masses and the centre of gravity by functions and point masses in the model's XML.
"""
