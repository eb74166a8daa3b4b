"""What benches of the estimator share: flights simulated in batches, real flights, and how estimates are judged."""
