"""Figures as plain values, and what is computed to draw them: amplitude spectra and thinned curves.

A section makes ``Figure`` objects from a result's arrays; the page draws them with plotly.js, a notebook with Plotly.
"""
