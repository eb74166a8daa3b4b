"""The version of the package, which results and kept steps of a diagnosis carry."""

VERSION = "0.1.0"
