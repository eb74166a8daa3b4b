"""Withheld effects: cases drawn at random, flown by the plants, diagnosed, and judged by their labels.

`plants` hands over bags and an aircraft file, and nothing else. `ledgers` keeps what was judged.
"""
