"""Layer ``flight``: FlightRecord and what reads and writes it (bag, ulog, csv)."""
