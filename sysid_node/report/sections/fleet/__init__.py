"""The sections of a fleet's page, one module each."""
