"""The sections of a manoeuvre's report: the plan, its predicted standard errors, and their correlations."""
