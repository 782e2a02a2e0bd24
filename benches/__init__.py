"""Side by side with the peers, in one run: `python -m benches`; see README.md."""
