"""A short period in gusts, and the textbook Kalman gain for it."""

import numpy as np
from made_models import NOISE, SHORT_PERIOD, flown, short_period_model, with_outputs
from scipy.linalg import expm, solve_discrete_are

GUSTS = np.array([0.02, 0.4])  # process noise of alpha and q, per root second


def in_gusts(rng, seconds=20.0, gusts=GUSTS):
    """A manoeuvre whose state is pushed about at random, with sensor noise on top."""
    model = short_period_model()
    calm = flown(model, seconds)
    system = np.array([[SHORT_PERIOD["Za"], 1.0], [SHORT_PERIOD["Ma"], SHORT_PERIOD["Mq"]]])
    control = np.array([SHORT_PERIOD["Zd"], SHORT_PERIOD["Md"]])
    x, outputs = np.zeros(2), np.empty_like(calm.outputs)
    fine = 10
    dt = calm.step / fine
    for k, de in enumerate(calm.inputs[:, 0]):
        outputs[k] = *x, 18.0 * (SHORT_PERIOD["Za"] * x[0] + SHORT_PERIOD["Zd"] * de)
        following = calm.inputs[min(k + 1, len(calm) - 1), 0]
        for i in range(fine):
            u = de + (i + 0.5) / fine * (following - de)
            x = x + dt * (system @ (x + 0.5 * dt * (system @ x + control * u)) + control * u)
            x = x + gusts * np.sqrt(dt) * rng.normal(size=2)
    return with_outputs(calm, outputs + NOISE * rng.normal(size=outputs.shape))


OBSERVATION = np.array([[1.0, 0.0], [0.0, 1.0], [18.0 * SHORT_PERIOD["Za"], 0.0]])


def transition(dt):
    A = np.array([[SHORT_PERIOD["Za"], 1.0], [SHORT_PERIOD["Ma"], SHORT_PERIOD["Mq"]]])
    return A, expm(A * dt)


def gain(dt, variances):
    """The textbook steady gain for variances of process noise (alpha, q; per second) and sensor noise."""
    F, Q, R = transition(dt)[1], sampled_noise(np.diag(variances[:2]), dt), np.diag(variances[2:])
    P = solve_discrete_are(F.T, OBSERVATION.T, Q, R)
    return P @ OBSERVATION.T @ np.linalg.inv(OBSERVATION @ P @ OBSERVATION.T + R)


def sampled_noise(Q, dt):
    """What continuous process noise adds to the state within a step: Van Loan, IEEE Trans. AC 23(3), 1978."""
    A, _ = transition(dt)
    both = expm(dt * np.block([[-A, Q], [np.zeros((2, 2)), A.T]]))
    return both[2:, 2:].T @ both[:2, 2:]
