"""The sections of a gap's report: the opening paragraph, and the panels from error to cause."""
