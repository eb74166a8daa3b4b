"""Models for the batch estimators, one file each."""
