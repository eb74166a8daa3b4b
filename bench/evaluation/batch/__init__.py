"""Parts of the batch estimators' bench: published analyses, coverage of intervals, the bundled flights."""
