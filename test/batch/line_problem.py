"""A maximum-likelihood problem whose responses are linear in the unknowns."""

import numpy as np
from made_models import SHORT_PERIOD, flown, noisy, short_period_model

from sysid_node.batch.likelihood.problem import LikelihoodProblem
from sysid_node.batch.likelihood.unknowns import Unknowns
from sysid_node.batch.models.model import ModelParameter
from sysid_node.batch.results.response import ModelResponse


class LineProblem(LikelihoodProblem):
    """Responses linear in z: three outputs along two directions each."""

    def __init__(self):
        parameters = tuple(
            ModelParameter(name, value, prior=(value, 0.5) if name == "Mq" else None)
            for name, value in SHORT_PERIOD.items()
        )
        model = short_period_model().changed(parameters=parameters)
        self.manoeuvre = noisy(flown(model), np.random.default_rng(1))
        super().__init__(Unknowns.of(model, [self.manoeuvre], (), ()))
        self.directions = np.random.default_rng(2).normal(size=(500, 3, 5))

    def start(self):
        return self.unknowns.start()

    def bounds(self):
        return self.unknowns.bounds()

    def responses(self, z):
        m = self.manoeuvre
        return [ModelResponse(m.name, m.time, ("alpha", "q", "az"), m.outputs, self.directions @ z)]

    def sensitivities(self, z):
        return [self.directions]
