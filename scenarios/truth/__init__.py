"""The exact answers: closed forms, the oracle, how far an answer holds, and the cache of
answers."""
