"""What a person runs: the command line and the browser app. Imports engine and viz."""
