"""What several commands share: their options, progress bars, and tables in the terminal."""
