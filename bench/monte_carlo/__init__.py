"""What benches of the online estimator share: simulated flights in batches, and how estimates from them are judged."""
